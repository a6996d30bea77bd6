// capture/sfm_images.h -- photos as structure from motion wants them.
#pragma once
#include <filesystem>

#include "capture/photo.h"
#include "dtr/base/progress.h"

namespace dtr::capture {

/// Fills `folder` with the photos upright under their original names, sub-folders included.
/// A photo that is upright, fits and is an 8-bit grey or RGB JPEG or PNG is linked (copied to
/// another disk), so its bytes and EXIF stay; all others are decoded, turned, shrunk to a long side
/// of at most `max_size_px` (0: no limit) by area averages, and written again: as JPEG of quality
/// 98 with their EXIF focal length under names that end in .jpg or .jpeg, else as PNG, whatever the
/// name ends in: COLMAP goes by the content. A shrunk photo has another camera: K is scaled per
/// axis by the ratios of the sizes, TargetSize(width_px, height_px, max_size_px) over the photo's.
/// A photo's mask is written to SfmMaskFile, of the size that the photo has there.
/// What is there already is replaced, never written into: it may be a link to an original.
/// Photos in memory at a time take at most `memory_gb` (GB of 1e9 bytes; 0: no bound; one may be
/// larger). Throws Error when a photo cannot be read or a file cannot be written.
void PrepareSfmImages(const Capture& capture, const std::filesystem::path& folder, int max_size_px,
                      double memory_gb, Progress& progress);
/// The same without progress and bound.
void PrepareSfmImages(const Capture& capture, const std::filesystem::path& folder, int max_size_px);

/// Where PrepareSfmImages(..., folder, ...) puts the mask of a photo; empty for one without.
std::filesystem::path SfmMaskFile(const std::filesystem::path& folder, const Photo& photo);

}  // namespace dtr::capture
