// stereo/patchmatch/patchmatch_engine.h -- slanted planes in several views (PatchMatch).
#pragma once
#include <atomic>

#include "stereo/engine.h"
#include "stereo/left_out.h"

namespace dtr::stereo {

/// PatchMatch multi-view stereo: a plane in inverse depth per pixel, spread over a checkerboard
/// from near and far pixels, evaluated by bilateral NCC in the views that see the pixel, coarse to
/// fine (Bleyer et al., BMVC 2011; Galliani et al., ICCV 2015; Xu and Tao, CVPR 2019). Then
/// passes in which the neighbours' planes of the pass before suggest planes of their own and a
/// plane costs more the farther its round trip through a neighbour's map misses the pixel (Xu and
/// Tao, sec. 4.2). View weights are the selection probabilities themselves, random numbers are
/// hashes of the pixel: nothing depends on history or threads. The search uses the first
/// QualitySettings::neighbours, the passes the first QualitySettings::pass_neighbours, Estimate,
/// which is the search alone, the more of both. Memory (WorkBytes) does not depend on the number of
/// threads: at full size 113 bytes per pixel of the reference and 7 per pixel of each neighbour.
class PatchMatchEngine final : public Engine, public CountsLeftOut {
 public:
  explicit PatchMatchEngine(const QualitySettings& quality = {}) : quality_(quality) {}
  std::string name() const override { return "patchmatch"; }
  DepthEstimate Estimate(std::span<const StereoView> views, int reference,
                         std::span<const int> neighbours, const DepthRange& range,
                         const EngineOptions& options) const override;
  int Passes() const override;
  int Neighbours() const override;
  std::uint64_t WorkBytes(std::span<const StereoView> views, int reference,
                          std::span<const int> neighbours) const override;
  PlaneMap Match(std::span<const StereoView> views, int reference, std::span<const int> neighbours,
                 const DepthRange& range, const EngineOptions& options) const override;
  PlaneMap Refine(std::span<const StereoView> views, int reference, std::span<const int> neighbours,
                  const DepthRange& range, std::span<const PlaneMap* const> maps, int pass,
                  const EngineOptions& options) const override;
  DepthEstimate Filter(std::span<const StereoView> views, int reference,
                       std::span<const int> neighbours, const DepthRange& range,
                       std::span<const PlaneMap* const> maps,
                       const EngineOptions& options) const override;
  int without_planes() const override { return without_planes_; }

 private:
  QualitySettings quality_;
  mutable std::atomic<int> without_planes_{0};  // a count of calls, of no influence on any
};

}  // namespace dtr::stereo
