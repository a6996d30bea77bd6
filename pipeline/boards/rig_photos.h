// pipeline/boards/rig_photos.h -- what the cameras of a rig saw of a board, from photos or
// videos.
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "calib/boards/board.h"
#include "calib/boards/detect.h"
#include "calib/lens_camera.h"
#include "calib/solve/rig.h"
#include "capture/contents.h"
#include "dtr/base/progress.h"

namespace dtr::pipeline {

struct RigPhotoCamera {
  std::string name;
  int width_px = 0, height_px = 0;
};

struct RigPhotos {
  capture::FolderContents contents;     ///< of the folder
  std::vector<RigPhotoCamera> cameras;  ///< in byte order of names
  std::vector<std::string> frames;      ///< by time (FrameTimes); empty where a number is missing
  std::vector<calib::RigView> views;    ///< rising frame, then camera
  std::vector<calib::LeftOut> left_out;
};

/// Three layouts, told apart by what the folder holds:
///  - sub-folders, one per camera, with photos; photos of the same name (without extension) are of
///    one time step;
///  - photos named CAMERA and a number, as left01.jpg and right01.jpg; same number, same time step;
///  - videos, one per camera; frames of the same number are of one time step, or as timestamps.csv
///    beside them says (columns sync_index, cam_id, frame_index; cam_id is the number at the end of
///    the video's name; without frame_index a camera's rows in order are its frames).
/// Photos that a program has rotated are put back on the grid of their camera's others
/// (sensor_grid.h); cameras may be `known`, by name.
/// Photos without the board, and of another size, are listed in left_out; frames in which no camera
/// sees it are dropped from the views, but keep their place in time. The result is the same for any
/// number of threads. Throws UsageError when the folder holds none of these, Error when a camera
/// has no photo that shows the board.
RigPhotos ReadRigPhotos(const std::filesystem::path& folder, const calib::Board& board,
                        const calib::DetectOptions& options, Progress& progress,
                        const std::map<std::string, calib::LensCamera>& known = {});

}  // namespace dtr::pipeline
