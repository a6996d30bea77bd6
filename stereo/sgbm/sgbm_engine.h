// stereo/sgbm/sgbm_engine.h -- the baseline engine: OpenCV's semi-global matching, pairs fused.
#pragma once
#include "stereo/engine.h"
#include "stereo/sgbm/rectify.h"

namespace dtr::stereo {

/// Rectifies the reference with each neighbour, matches, and lets the pairs vote per pixel.
class SgbmEngine final : public Engine {
 public:
  explicit SgbmEngine(const PairLimits& limits = {}, int neighbours = 5)
      : limits_(limits), neighbours_(neighbours) {}
  std::string name() const override { return "sgbm"; }
  int Neighbours() const override { return neighbours_; }
  DepthEstimate Estimate(std::span<const StereoView> views, int reference,
                         std::span<const int> neighbours, const DepthRange& range,
                         const EngineOptions& options) const override;

 private:
  PairLimits limits_;
  int neighbours_;
};

}  // namespace dtr::stereo
