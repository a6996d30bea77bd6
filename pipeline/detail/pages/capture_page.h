// pipeline/detail/pages/capture_page.h -- photos to look at before hours are spent on them.
#pragma once
#include <string>

#include "capture/photo.h"
#include "dtr/base/progress.h"
#include "dtr/types/grid.h"

namespace dtr::pipeline {

/// What the photos look like: one contact sheet, and a page that opens offline with it, the photos
/// that have faults (what is wrong, by how much), all photos and what was skipped.
struct CaptureLook {
  ImageRgb8 contact_sheet;
  std::string page;
};
CaptureLook LookAt(const capture::Capture& capture, const std::string& title, int threads,
                   double memory_gb, Progress& progress);

}  // namespace dtr::pipeline
