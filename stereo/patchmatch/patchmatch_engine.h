// stereo/patchmatch/patchmatch_engine.h -- slanted planes in several views (PatchMatch).
#pragma once
#include "stereo/engine.h"

namespace dtr::stereo {

/// PatchMatch multi-view stereo: a plane in inverse depth per pixel, spread over a checkerboard
/// from near and far pixels, judged by bilateral NCC in the views that see the pixel, coarse to
/// fine (Bleyer et al., BMVC 2011; Galliani et al., ICCV 2015; Xu and Tao, CVPR 2019). View weights
/// are the selection probabilities themselves, random numbers are hashes of the pixel: nothing
/// depends on history or threads. At most the first 8 neighbours are used. Memory does not depend
/// on the number of threads: about 60 bytes per pixel of the reference and 6 per pixel of each
/// neighbour.
class PatchMatchEngine final : public Engine {
 public:
  std::string name() const override { return "patchmatch"; }
  DepthEstimate Estimate(std::span<const StereoView> views, int reference,
                         std::span<const int> neighbours, const DepthRange& range,
                         const EngineOptions& options) const override;
};

}  // namespace dtr::stereo
