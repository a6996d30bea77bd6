// pipeline/boards/validate_calibration.h -- validates a calibration file, by held-out photos if
// there are any.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "calib/files/calibration.h"
#include "calib/validation/boards.h"
#include "dtr/base/progress.h"

namespace dtr::pipeline {

/// The calibration with its observations as calib::ValidateBoards takes it.
calib::ValidatedCalibration ToValidate(const calib::Calibration& calibration);

/// A camera from elsewhere (.yml, .yaml of OpenCV or ROS, cameras.txt of COLMAP with one camera),
/// to be validated by photos of a board: no observations. Throws Error where the lens is of a model
/// that boards are not solved with, and as ReadLens (lens_file.h) does.
calib::Calibration ForeignCalibration(const std::filesystem::path& file, const calib::Board& board);

struct TestPhotos {
  calib::TestViews test_views;
  /// Without a usable board, of another size, repeated, or what the calibration was made from.
  std::vector<calib::LeftOut> left_out;
};

/// Looks for the calibration's board in photos that it has not seen: of a single camera the photos
/// of `folder` whose names match `pattern`, of a rig what ReadRigPhotos finds there (`pattern` must
/// be "*"). Cameras of a rig are matched by name. A photo whose corners are those of a view that
/// the calibration keeps (of one with moved corners: whose name) is the one that it was made from,
/// and is left out. Throws Error when sizes
/// differ from the calibration's, a camera is not there or nothing is left.
TestPhotos ReadTestPhotos(const calib::Calibration& calibration,
                          const std::filesystem::path& folder, const std::string& pattern,
                          Progress& progress);

/// The report as a page: validation result and tests, residual vectors, coverage, maps, worst
/// views. Views are drawn over their photos where `images` has them.
std::string CalibrationPage(const calib::Calibration& calibration,
                            const calib::BoardValidation& report, const std::string& title,
                            const std::optional<std::filesystem::path>& images);

}  // namespace dtr::pipeline
