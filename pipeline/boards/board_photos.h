// pipeline/boards/board_photos.h -- a folder of photos of a board becomes views of it.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/boards/board.h"
#include "calib/boards/detect.h"
#include "calib/lens_camera.h"
#include "capture/contents.h"
#include "dtr/base/progress.h"

namespace dtr::pipeline {

struct BoardPhotos {
  capture::FolderContents contents;  ///< of the folder; photos: those that match
  int width_px = 0, height_px = 0;
  std::vector<calib::BoardView> views;   ///< in byte order of names
  std::vector<calib::LeftOut> left_out;  ///< photos without a usable board, of another size, or
                                         ///< that repeat another one (calib/boards/repeats.h)
};

/// Looks for the board in the photos of `folder` whose names match `pattern` (a shell pattern as
/// left*.jpg). Pixels are taken as stored: EXIF orientation would turn some photos of a camera and
/// not others. Photos that a program has rotated are put back on the grid of the others
/// (sensor_grid.h), of which the camera may be known. The result is the same for any number of
/// threads. Throws UsageError when the folder does not exist, nothing matches or the photos show
/// another board (board_given.h), Error when no photo shows the board.
BoardPhotos ReadBoardPhotos(const std::filesystem::path& folder, const std::string& pattern,
                            const calib::Board& board, const calib::DetectOptions& options,
                            Progress& progress, const std::optional<calib::LensCamera>& known = {});

}  // namespace dtr::pipeline
