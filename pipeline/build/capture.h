// pipeline/build/capture.h -- photos or videos, as a capture to look at before hours are spent on
// it.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "capture/photo.h"
#include "capture/split_panoramas.h"
#include "capture/video/ingest_video.h"
#include "dtr/base/progress.h"
#include "dtr/types/grid.h"

namespace dtr::pipeline {

/// capture::VideosOf. Throws UsageError where there are none though `video` asks for something of
/// them.
std::vector<std::filesystem::path> VideosFor(const std::filesystem::path& source,
                                             const capture::VideoOptions& video);

/// The photos of a folder, or the chosen frames of a video or of a folder of videos, which are
/// written first into the folder that `frames_folder` names (what is there already is removed); it
/// is asked once it is known that frames are to come. Panoramas are split, into a folder below it.
/// Throws as capture::IngestPhotos, capture::IngestVideos and capture::SplitPanoramas do.
capture::Capture Ingest(const std::filesystem::path& source, const capture::VideoOptions& video,
                        capture::PanoramaUse panoramas,
                        const std::function<std::filesystem::path()>& frames_folder,
                        Progress& progress);

/// What the photos look like: one contact sheet, and a page that opens offline with it, the photos
/// that have faults (what is wrong, by how much), all photos and what was skipped.
struct CaptureLook {
  ImageRgb8 contact_sheet;
  std::string page;
};
CaptureLook LookAt(const capture::Capture& capture, const std::string& title, double memory_gb,
                   Progress& progress);

}  // namespace dtr::pipeline
