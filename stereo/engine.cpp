#include "stereo/engine.h"

#include "stereo/patchmatch/patchmatch_engine.h"
#include "stereo/sgbm/sgbm_engine.h"

namespace dtr::stereo {

PlaneMap Engine::Match(std::span<const StereoView>, int, std::span<const int>, const DepthRange&,
                       const EngineOptions&) const {
  throw std::logic_error(name() + ": has no rounds");
}

PlaneMap Engine::Refine(std::span<const StereoView>, int, std::span<const int>, const DepthRange&,
                        std::span<const PlaneMap* const>, int, const EngineOptions&) const {
  throw std::logic_error(name() + ": has no rounds");
}

DepthEstimate Engine::Judge(std::span<const StereoView>, int, std::span<const int>,
                            const DepthRange&, std::span<const PlaneMap* const>,
                            const EngineOptions&) const {
  throw std::logic_error(name() + ": has no rounds");
}

std::unique_ptr<Engine> MakeEngine(const std::string& name) {
  if (name == "sgbm") return std::make_unique<SgbmEngine>();
  if (name == "patchmatch") return std::make_unique<PatchMatchEngine>();
  throw UsageError("stereo engine: expected one of patchmatch, sgbm, found '" + name + "'");
}

}  // namespace dtr::stereo
