// cli/pipeline/video_frames.h -- a video, frame by frame.
#pragma once
#include <filesystem>
#include <functional>
#include <string>

#include "dtr/types/grid.h"

namespace dtr::pipeline {

/// True for the extensions of videos that are read, any case, with the dot.
bool IsVideoExtension(const std::string& extension);

/// Decodes a video (OpenCV's videoio, so FFmpeg) from its first frame on and calls `take` with each
/// frame's number, from 0, and picture; stops when it returns false. Throws Error where the file is
/// no video or holds no frame.
void ForEachFrame(const std::filesystem::path& file,
                  const std::function<bool(int, const ImageRgb8&)>& take);

}  // namespace dtr::pipeline
