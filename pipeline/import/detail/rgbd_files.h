// pipeline/import/detail/rgbd_files.h -- captures of phones and depth cameras as cameras of a set.
#pragma once
#include "pipeline/import/detail/camera_files.h"

namespace dtr::pipeline {

/// Cameras, folders and unit of a capture, of a format of io::RgbdFormats(). Throws Error as
/// io::ReadRgbdCapture does.
CamerasFromFile FromRgbdCapture(const std::filesystem::path& capture, const std::string& format,
                                const CameraFileFolders& folders);

}  // namespace dtr::pipeline
