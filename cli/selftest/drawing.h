// cli/selftest/drawing.h -- what cases of rendering draw with, and how their images are evaluated.
#pragma once
#include <deque>
#include <string>
#include <vector>

#include "cli/selftest/cases.h"
#include "datasets/exact/render_scenes.h"

namespace dtr::selftest {

const char* InWords(RenderMethod method);  ///< ", two passes", to end a measure's words with

/// What a case draws with: one renderer, counts of what is wrong with its images.
class Drawing {
 public:
  Drawing(const NamedRenderer& renderer) : render_(renderer.make()), methods_(renderer.methods) {}

  const std::vector<RenderMethod>& methods() const { return methods_; }  ///< that it draws

  RenderResult Draw(const RenderScene& scene, const testing::Shot& novel, RenderOptions options);
  RenderResult Draw(const DtrSet& set, const testing::Shot& novel, const RenderOptions& options);
  RenderResult Draw(DtrSet&& set, const testing::Shot& novel, const RenderOptions& options);
  /// A set that lives as long as the renderer. Renderers know views by their addresses: one that
  /// died could be taken for the next set's.
  const DtrSet& Keep(DtrSet set);
  /// With what was wrong.
  Outcome Finish(Outcome outcome) const;

 private:
  std::deque<DtrSet> kept_;
  RenderFunction render_;
  std::vector<RenderMethod> methods_;
  long long contradictions_ = 0, not_finite_ = 0;
};

// The texture of a view changes by up to 14 levels a pixel; half a level is what bilinear colours
// miss of it, one more what 8 bits round.
inline constexpr int kSameColour = 4;

/// What was drawn against a photograph of the surface from the same place.
struct Score {
  double seen = 0;    ///< share of the true pixels that are covered
  double right = 0;   ///< share of the covered ones whose depth is within `tolerance` of the truth
  double colour = 0;  ///< share of the covered ones whose colour is the true one
};
Score ScoreOf(const RenderResult& result, const View& truth, double tolerance);

// Cases about many views and what they weigh, crowd_cases.cpp.
Outcome ManyViews(Drawing draw);
Outcome DuplicateCameras(Drawing draw);
Outcome ExtremeWeights(Drawing draw);

}  // namespace dtr::selftest
