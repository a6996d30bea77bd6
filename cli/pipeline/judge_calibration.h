// cli/pipeline/judge_calibration.h -- a calibration file and perhaps unseen photos, judged.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "calib/files/calibration.h"
#include "calib/judge/judge.h"
#include "dtr/base/progress.h"

namespace dtr::pipeline {

/// The calibration with its observations as calib::Judge takes it.
calib::JudgedCalibration JudgedFrom(const calib::Calibration& calibration);

/// Looks for the calibration's board in photos that it has not seen: of a single camera the photos
/// of `folder`, of a rig what ReadRigPhotos finds there. Cameras of a rig are matched by name.
/// Throws Error when sizes differ from the calibration's or a camera is not there.
calib::UnseenViews ReadUnseen(const calib::Calibration& calibration,
                              const std::filesystem::path& folder, int threads, Progress& progress);

/// The report as a page: verdict and tests, residual vectors, coverage, maps, worst views. Views
/// are drawn over their photos where `images` has them.
std::string CalibrationPage(const calib::Calibration& calibration, const calib::JudgeReport& report,
                            const std::string& title,
                            const std::optional<std::filesystem::path>& images);

}  // namespace dtr::pipeline
