#include "pipeline/import/detail/rgbd_files.h"

#include <utility>

#include "dtr/io/formats/rgbd_capture.h"

namespace dtr::pipeline {

CamerasFromFile FromRgbdCapture(const std::filesystem::path& capture, const std::string& format,
                                const CameraFileFolders& folders) {
  io::RgbdCapture read = io::ReadRgbdCapture(capture, format, folders.images);
  CamerasFromFile cameras;
  cameras.list = std::move(read.list);
  cameras.list.photo_grid = PhotoGrid::kStored;
  cameras.images_dir = std::move(read.images);
  cameras.depth_dir = std::move(read.depth);
  cameras.confidence = std::move(read.confidence);
  cameras.depth_unit = read.depth_unit_m;
  cameras.unpacked = std::move(read.unpacked);
  cameras.skipped = std::move(read.skipped);
  cameras.notes = std::move(read.notes);
  return cameras;
}

}  // namespace dtr::pipeline
