// tests/eval/clockwork.h -- a renderer whose times and images are worked out, and sets for it.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "dtr/eval/timed_renderer.h"
#include "dtr/render/finish_image.h"
#include "dtr/types/dtr_set.h"
#include "tests/eval/plane_views.h"

namespace dtr::eval::testing {

/// A set of `sources` views of a plane and, maybe, a held-out one; images grey, level 100.
inline DtrSet Planes(int sources, bool held_out) {
  DtrSet set;
  set.frames.resize(1);
  for (int i = 0; i < sources + (held_out ? 1 : 0); ++i) {
    View view = PlaneView(i, 0, false);
    view.id = view.name = "v" + std::to_string(i);
    view.reference_baseline = 1;
    view.image = ImageRgb8(80, 60, 3, 100);
    set.frames[0].views.push_back(std::move(view));
  }
  if (held_out) {
    set.frames[0].views.back().role = ViewRole::kHeldOut;
    set.frames[0].views.back().depth = DepthImage();
  }
  set.scene_center = {1, 0, 10};
  return set;
}

/// Paints level 100 + (0 two-pass, 10 deferred) and says that each frame took a time worked out
/// from the options, so that no test depends on a clock.
class Clockwork final : public TimedRenderer {
 public:
  explicit Clockwork(bool gpu) : gpu_(gpu) {}
  std::string Description() const override { return "clockwork"; }
  bool HasGpuClock() const override { return gpu_; }
  FrameTime Draw(const RenderScene& scene, const PinholeCamera& novel, const Pose&,
                 const RenderOptions& options) override {
    EXPECT_FALSE(NeedsFinishing(options));
    methods.push_back(options.method);
    blends.insert(options.blend);
    widths.push_back(novel.width_px());
    views_in_scene.push_back(static_cast<int>(scene.views.size()));
    const bool deferred = options.method == RenderMethod::kDeferred;
    const int used =
        std::min({options.views, static_cast<int>(scene.views.size()), room_for_views});
    drawn_ = RenderResult{};
    drawn_.image =
        ImageRgb8(novel.width_px(), novel.height_px(), 3, deferred ? deferred_level : 102);
    drawn_.coverage = Mask(novel.width_px(), novel.height_px(), 1, 255);
    drawn_.depth = DepthImage(novel.width_px(), novel.height_px());
    for (int i = 0; i < used; ++i) drawn_.views_used.push_back(i);
    const double ms = (deferred ? 10.0 : 120.0) * used / (options.resolution * options.resolution);
    FrameTime time{2 * ms, ms, std::nullopt};
    if (gpu_) time.gpu_ms = ms / 100;
    return time;
  }
  RenderResult ReadBack() override { return drawn_; }

  std::vector<RenderMethod> methods;
  std::set<BlendWeight> blends;
  std::vector<int> widths, views_in_scene;
  std::uint8_t deferred_level = 110;
  int room_for_views = 1000;  ///< more are left out, as memory does

 private:
  const bool gpu_;
  RenderResult drawn_;
};

}  // namespace dtr::eval::testing
