// pipeline/core/set_stream.h -- the views of a set on disk, read when an image needs them.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/render/view_stream.h"

namespace dtr::pipeline {

/// What --memory says.
struct StreamLimits {
  double memory_gb = 4;
  bool measured_only = false;  ///< without completed depth
  /// What other things leave of memory_gb to the views; absent: all of it.
  std::optional<double> view_bytes = std::nullopt;
};

/// A stream of the pixels in `folder`. `set` is what ReadSet gave, its duplicates collapsed;
/// `described` is of it, a scene for each frame. A view that alone takes more than the memory is
/// left out. `console` is told, once each, of what is left out;
/// it and `set` must outlive the stream.
std::unique_ptr<ViewStream> StreamOf(const std::filesystem::path& folder, DtrSet& set,
                                     std::vector<RenderScene> described, const StreamLimits& limits,
                                     Progress& console);

}  // namespace dtr::pipeline
