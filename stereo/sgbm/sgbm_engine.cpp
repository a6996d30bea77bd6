#include "stereo/sgbm/sgbm_engine.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dtr/base/parallel_for.h"
#include "stereo/sgbm/fuse.h"

namespace dtr::stereo {
namespace {

/// Connected areas smaller than this share of the image are taken for chance matches: about 60
/// pixels at 960x640. Pixels connect across at most this many pixels of disparity.
constexpr double kSpeckleShare = 1e-4;
constexpr double kSpeckleSteps = 2.0;

/// StereoSGBM in full mode keeps two 16-bit numbers per pixel and disparity.
constexpr double kBytesPerCell = 4;

/// Pairs that may be matched at the same time within the memory given; at least one.
int PairsAtOnce(const std::vector<RectifiedPair>& pairs, const EngineOptions& options) {
  double largest = 1;
  for (const RectifiedPair& p : pairs) {
    largest = std::max(largest, kBytesPerCell * p.disparities * p.reference.height_px() *
                                    (p.reference.width_px() - p.disparities));
  }
  return static_cast<int>(std::clamp(options.memory_gb * 1e9 / largest, 1.0, 1e6));
}

void CheckRequest(std::span<const StereoView> views, int reference, std::span<const int> neighbours,
                  const DepthRange& range) {
  const auto exists = [&](int i) { return i >= 0 && static_cast<size_t>(i) < views.size(); };
  for (const int n : neighbours) {
    if (!exists(n) || n == reference) throw std::invalid_argument("Estimate: no such neighbour");
  }
  if (!exists(reference)) throw std::invalid_argument("Estimate: no such reference view");
  if (!(range.near_z > 0) || !(range.far_z > range.near_z) || !std::isfinite(range.far_z)) {
    throw Error("view " + std::to_string(reference) +
                ": depth range, expected 0 < near < far, found " + std::to_string(range.near_z) +
                " to " + std::to_string(range.far_z));
  }
}

}  // namespace

DepthEstimate SgbmEngine::Estimate(std::span<const StereoView> views, int reference,
                                   std::span<const int> neighbours, const DepthRange& range,
                                   const EngineOptions& options) const {
  CheckRequest(views, reference, neighbours, range);
  const StereoView& view = views[static_cast<size_t>(reference)];
  std::vector<RectifiedPair> rectified;
  std::vector<const StereoView*> partners;
  std::string reasons;
  for (const int n : neighbours) {
    std::string refusal;
    const StereoView& other = views[static_cast<size_t>(n)];
    if (const auto pair = RectifyPair(view, other, range, limits_, &refusal)) {
      rectified.push_back(*pair);
      partners.push_back(&other);
    } else {
      reasons += "; with view " + std::to_string(n) + ": " + refusal;
    }
  }
  if (rectified.empty()) {
    throw NoUsablePair("view " + std::to_string(reference) + ": no usable stereo pair among " +
                       std::to_string(neighbours.size()) + " neighbours" + reasons);
  }

  const Picture reference_picture = MakePicture(view);
  std::vector<PairDepth> pairs(rectified.size());
  const int at_once = std::min(ResolveThreads(options.threads), PairsAtOnce(rectified, options));
  ParallelFor(0, static_cast<int>(pairs.size()), at_once, [&](int i) {
    const auto k = static_cast<size_t>(i);
    pairs[k] = MatchPair(reference_picture, MakePicture(*partners[k]), rectified[k]);
  });
  DepthEstimate estimate = FusePairs(view.camera, pairs, range, options.threads);
  const int min_pixels = static_cast<int>(kSpeckleShare * view.camera.width_px() *
                                          static_cast<double>(view.camera.height_px()));
  RemoveSpeckles(view.camera, pairs, min_pixels, kSpeckleSteps, &estimate);
  return estimate;
}

}  // namespace dtr::stereo
