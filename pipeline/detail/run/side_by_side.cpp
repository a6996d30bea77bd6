#include "pipeline/detail/run/side_by_side.h"

#include <atomic>

#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"

namespace dtr::pipeline {
namespace {

// Of a view with image, mask, depth, completed depth and standard deviation, and what is made of
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

void SideBySide(size_t count, const std::string& stage, const Room& room,
                const std::function<double(size_t k)>& bytes, Progress& progress,
                const std::function<void(size_t k)>& body) {
  if (!stage.empty()) progress.Stage(stage, static_cast<int>(count));
  MemoryBudget memory(kShareOfMemory * room.memory_gb);
  std::atomic<int> done = 0;
  ParallelFor(0, static_cast<int>(count), room.threads, [&](int k) {
    progress.ThrowIfInterrupted();
    const auto share = memory.Take(bytes(static_cast<size_t>(k)));
    body(static_cast<size_t>(k));
    if (!stage.empty()) progress.Update(++done);
  });
}

void ForViews(std::span<const View> views, std::span<const int> which, const std::string& stage,
              const Room& room, Progress& progress, const std::function<void(size_t k)>& body) {
  const auto bytes = [&](size_t k) {
    const PinholeCamera& camera = views[static_cast<size_t>(which[k])].camera;
    return kBytesPerPixel * camera.width_px() * camera.height_px();
  };
  SideBySide(which.size(), stage, room, bytes, progress, body);
}

}  // namespace dtr::pipeline
