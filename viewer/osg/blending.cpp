// The report's blend functions (appendix III), by RENDER_SPEC 4.5 and 4.6.
#include <algorithm>
#include <string>

#include "dtr/base/error.h"
#include "dtr/render/blend_weights.h"
#include "viewer/osg/depth_tr.h"

namespace osgDTR {
namespace {

using Angles = std::vector<double>;
using Flags = std::vector<bool>;
using Positions = std::vector<int>;

void CheckLengths(const Angles& angles, const Flags& flags) {
  if (flags.size() == angles.size()) return;
  throw dtr::UsageError("DepthTR: expected a flag for each of " + std::to_string(angles.size()) +
                        " angles, found " + std::to_string(flags.size()));
}

/// Shares of the flagged views at `positions`.
void Weigh(const dtr::RenderOptions& options, double novel_fx_px, const Angles& angles,
           std::vector<double>& weights, const Flags& flags, const Positions& positions) {
  CheckLengths(angles, flags);
  std::vector<size_t> counted;
  Angles of_counted;
  for (const int position : positions) {
    const auto at = static_cast<size_t>(position);
    if (position < 0 || at >= angles.size()) {
      throw dtr::UsageError("DepthTR: expected positions below " + std::to_string(angles.size()) +
                            ", found " + std::to_string(position));
    }
    if (!flags[at]) continue;
    counted.push_back(at);
    of_counted.push_back(angles[at]);
  }
  weights.assign(angles.size(), 0.0);
  if (counted.empty()) return;
  std::vector<double> shares(counted.size());
  dtr::BlendShares(dtr::BlendParametersOf(options, novel_fx_px, {}), of_counted, shares);
  for (size_t i = 0; i < counted.size(); ++i) weights[counted[i]] = shares[i];
}

// Before there is a novel camera: a pixel of a thousandth of a radian, as of a common photo.
constexpr double kUsualFocalPx = 1000;

}  // namespace

void DepthTR::computeWeights(int reqNumber, dtr::BlendWeight blendType, const Angles& angles,
                             std::vector<double>& weights, const Flags& flags) const {
  CheckLengths(angles, flags);
  Positions positions;
  for (size_t i = 0; i < angles.size(); ++i) {
    if (flags[i]) positions.push_back(static_cast<int>(i));
  }
  std::stable_sort(positions.begin(), positions.end(), [&](int a, int b) {
    return angles[static_cast<size_t>(a)] < angles[static_cast<size_t>(b)];
  });
  if (positions.size() > static_cast<size_t>(std::max(0, reqNumber))) {
    positions.resize(static_cast<size_t>(std::max(0, reqNumber)));
  }
  const int k = getRenderOptions().blend_k;
  switch (blendType) {
    case dtr::BlendWeight::kCosine:
      return cosAngleBlending(angles, weights, flags, positions);
    case dtr::BlendWeight::kExponential:
      return exponentialAngleBlending(angles, weights, flags, positions);
    case dtr::BlendWeight::kAngle:
      return angleBlending(angles, weights, flags, positions);
    case dtr::BlendWeight::kInverseAngle:
      return inverseAngleBlending(k, angles, weights, flags, positions);
    case dtr::BlendWeight::kKNearest:
      return newAngleBlending(k, angles, weights, flags, positions);
  }
}

void DepthTR::BlendBy(dtr::BlendWeight blend, std::optional<int> k, const Angles& angles,
                      std::vector<double>& weights, const Flags& flags,
                      const Positions& positions) const {
  dtr::RenderOptions options = getRenderOptions();
  options.blend = blend;
  options.blend_k = k.value_or(options.blend_k);
  dtr::CheckRenderOptions(options);
  Weigh(options, novel_ ? novel_->camera.fx_px() : kUsualFocalPx, angles, weights, flags,
        positions);
}

void DepthTR::angleBlending(const Angles& angles, std::vector<double>& weights, const Flags& flags,
                            const Positions& positions) const {
  BlendBy(dtr::BlendWeight::kAngle, {}, angles, weights, flags, positions);
}
void DepthTR::exponentialAngleBlending(const Angles& angles, std::vector<double>& weights,
                                       const Flags& flags, const Positions& positions) const {
  BlendBy(dtr::BlendWeight::kExponential, {}, angles, weights, flags, positions);
}
void DepthTR::cosAngleBlending(const Angles& angles, std::vector<double>& weights,
                               const Flags& flags, const Positions& positions) const {
  BlendBy(dtr::BlendWeight::kCosine, {}, angles, weights, flags, positions);
}
void DepthTR::newAngleBlending(int k, const Angles& angles, std::vector<double>& weights,
                               const Flags& flags, const Positions& positions) const {
  BlendBy(dtr::BlendWeight::kKNearest, k, angles, weights, flags, positions);
}
void DepthTR::inverseAngleBlending(int k, const Angles& angles, std::vector<double>& weights,
                                   const Flags& flags, const Positions& positions) const {
  BlendBy(dtr::BlendWeight::kInverseAngle, k, angles, weights, flags, positions);
}

}  // namespace osgDTR
