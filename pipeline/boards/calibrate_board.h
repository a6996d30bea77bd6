// pipeline/boards/calibrate_board.h -- photos of a board become a calibration.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "calib/files/calibration.h"
#include "calib/solve/board_solve.h"
#include "pipeline/boards/board_photos.h"

namespace dtr::pipeline {

struct BoardCalibrationOptions {
  std::optional<calib::BoardModel> model;  ///< empty: chosen by held-out views
  calib::SolveOptions solve;
  std::uint64_t seed = 0;
};

/// Solves for the camera `name` behind the photos; `progress` shows the solves that choose the
/// model, and may interrupt. Throws Error as SolveBoard and ChooseModel do.
calib::Calibration CalibrateBoard(const calib::Board& board, const BoardPhotos& photos,
                                  const std::string& name, const BoardCalibrationOptions& options,
                                  Progress& progress);

/// Writes the calibration by the name's extension (any case): .json ours, .yml and .yaml OpenCV's,
/// .txt COLMAP's cameras.txt with the camera's index + 1 as its id.
void WriteCameraFile(const std::filesystem::path& file, const calib::Calibration& calibration);

}  // namespace dtr::pipeline
