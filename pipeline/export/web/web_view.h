// pipeline/export/web/web_view.h -- a view as few bytes, for the page of `dtr export --format web`.
#pragma once
#include <filesystem>
#include <string>

#include "dtr/types/view.h"

namespace dtr::pipeline {

/// How closely a page holds a set.
struct WebCoding {
  int jpeg_quality = 85;
  /// Largest error of depth by rounding, pixels of disparity.
  double depth_error_px = 0.15;
  /// Also photos that the set stores as JPEG; else those go in as they are.
  bool recodes_jpeg = false;
};

/// As docs/EXPORT.md describes it.
struct WebView {
  std::string bytes;
  std::string json;  ///< an object
};

/// Whether its photo can go into a page as it is.
bool IsStoredAsJpeg(const View& view);

/// Of a view that has its photo, depth (completed depth with it) and mask loaded; sigma, too, where
/// the set has it. `set`: the set's folder.
WebView PackView(const View& view, const std::filesystem::path& set, const WebCoding& coding);

}  // namespace dtr::pipeline
