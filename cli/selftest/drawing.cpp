#include "cli/selftest/drawing.h"

#include <cmath>

#include "dtr/render/scene.h"

namespace dtr::selftest {

using testing::Shot;

const char* InWords(RenderMethod method) {
  return method == RenderMethod::kTwoPass ? ", two passes" : ", deferred";
}

RenderResult Drawing::Draw(const RenderScene& scene, const Shot& novel, RenderOptions options) {
  RenderResult result = render_(scene, novel.camera, novel.cam_from_world, options);
  contradictions_ += testing::Contradictions(result);
  for (const float z : result.depth.grid().data()) not_finite_ += !std::isfinite(z);
  return result;
}

RenderResult Drawing::Draw(const DtrSet& set, const Shot& novel, const RenderOptions& options) {
  return Draw(MakeRenderScene(set), novel, options);
}

RenderResult Drawing::Draw(DtrSet&& set, const Shot& novel, const RenderOptions& options) {
  return Draw(Keep(std::move(set)), novel, options);
}

const DtrSet& Drawing::Keep(DtrSet set) {
  kept_.push_back(std::move(set));
  return kept_.back();
}

Outcome Drawing::Finish(Outcome outcome) const {
  outcome.not_finite += not_finite_;
  outcome.Add(Exactly("pixels whose depth, coverage and colour contradict each other",
                      static_cast<double>(contradictions_), 0,
                      "seen, with depth and from a view are one thing"));
  return outcome;
}

Score ScoreOf(const RenderResult& result, const View& truth, double tolerance) {
  double all = 0, seen = 0, right = 0, colour = 0;
  for (int y = 0; y < truth.depth.height(); ++y) {
    for (int x = 0; x < truth.depth.width(); ++x) {
      if (DepthImage::IsHole(truth.depth(x, y))) continue;
      ++all;
      if (result.coverage(x, y) == 0) continue;
      ++seen;
      right += std::abs(result.depth(x, y) / truth.depth(x, y) - 1) <= tolerance;
      colour += testing::PixelDifference(result.image, truth.image, x, y) <= kSameColour;
    }
  }
  return {all > 0 ? seen / all : 0, seen > 0 ? right / seen : 0, seen > 0 ? colour / seen : 0};
}

}  // namespace dtr::selftest
