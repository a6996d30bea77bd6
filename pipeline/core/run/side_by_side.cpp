#include "pipeline/core/run/side_by_side.h"

#include <algorithm>

#include "dtr/base/counted_for.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"

namespace dtr::pipeline {
namespace {

// For a view with image, mask, depth, completed depth and standard deviation, and what is made of
// them while it is looked at.
constexpr double kBytesPerPixel = 64;
constexpr double kShareOfMemory = 0.5;  // the rest is what the program holds besides

}  // namespace

std::vector<int> ViewsWithDepth(std::span<const View> views) {
  std::vector<int> indices;
  for (size_t i = 0; i < views.size(); ++i) {
    if (views[i].role == ViewRole::kSource && views[i].depth_file) {
      indices.push_back(static_cast<int>(i));
    }
  }
  return indices;
}

void SideBySide(size_t count, const std::string& stage, double memory_gb,
                const std::function<double(size_t k)>& bytes, Progress& progress,
                const std::function<void(size_t k)>& body) {
  if (!stage.empty()) progress.Stage(stage, static_cast<int>(count));
  const double room_bytes = kShareOfMemory * memory_gb * kBytesPerGigabyte;
  double largest_bytes = 1;
  for (size_t k = 0; k < count; ++k) largest_bytes = std::max(largest_bytes, bytes(k));
  // No more threads than have room: those that waited for it could not help inside the others.
  int at_once = ThreadLimit::Current();
  if (room_bytes > 0) {
    at_once = static_cast<int>(std::clamp(room_bytes / largest_bytes, 1.0, 1.0 * at_once));
  }
  const auto of_item = [&](int k) { body(static_cast<size_t>(k)); };
  if (!stage.empty()) return CountedFor(static_cast<int>(count), at_once, progress, of_item);
  ParallelFor(0, static_cast<int>(count), at_once, [&](int k) {
    progress.ThrowIfInterrupted();
    of_item(k);
  });
}

View Loaded(const View& view, const std::filesystem::path& folder, io::LoadOptions load) {
  View loaded = view;
  io::LoadPixels(folder, loaded, load);
  return loaded;
}

void ForViews(std::span<const View> views, std::span<const int> which, const std::string& stage,
              double memory_gb, Progress& progress, const std::function<void(size_t k)>& body) {
  const auto bytes = [&](size_t k) {
    const PinholeCamera& camera = views[static_cast<size_t>(which[k])].camera;
    return kBytesPerPixel * camera.width_px() * camera.height_px();
  };
  SideBySide(which.size(), stage, memory_gb, bytes, progress, body);
}

}  // namespace dtr::pipeline
