// dtr/render/frame_memory.h -- what an image takes in memory while it is made: the one place that
// knows it, for all renderers.
#pragma once
#include <string>

#include "dtr/types/camera.h"

namespace dtr {

/// Main memory that rendering an image, finishing it and writing it as PNG, JPEG or EXR takes at
/// its peak, bytes: what no renderer exceeds. Beside it lie the views, and bands of rows that do
/// not grow with the image.
double FrameBytes(int width_px, int height_px);

/// What encoding frames of that size as a video takes, bytes, in FFmpeg's process.
double VideoBytes(int width_px, int height_px);

/// Throws dtr::Error, "WHOSE: rendering 10000x10000 pixels takes 3.2 GB of memory, more than
/// `memory` 0.5; ...", where that exceeds the limit, 1e9 bytes.
void RequireFrameMemory(const PinholeCamera& camera, bool video, double memory_gb,
                        const std::string& whose);

/// The part of the limit that is left for views beside an image, bytes. Images of a window's size
/// take nothing from it: what they are drawn from depends on the limit alone.
double BytesForViews(const PinholeCamera& camera, double memory_gb);

}  // namespace dtr
