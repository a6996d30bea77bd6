#include "stereo/engine.h"

#include <stdexcept>

#include "stereo/patchmatch/patchmatch_engine.h"
#include "stereo/sgbm/sgbm_engine.h"

namespace dtr::stereo {

PlaneMap Engine::Match(std::span<const StereoView>, int, std::span<const int>, const DepthRange&,
                       const EngineOptions&) const {
  throw std::logic_error(name() + ": has no geometric-consistency passes");
}

PlaneMap Engine::Refine(std::span<const StereoView>, int, std::span<const int>, const DepthRange&,
                        std::span<const PlaneMap* const>, int, const EngineOptions&) const {
  throw std::logic_error(name() + ": has no geometric-consistency passes");
}

DepthEstimate Engine::Filter(std::span<const StereoView>, int, std::span<const int>,
                             const DepthRange&, std::span<const PlaneMap* const>,
                             const EngineOptions&) const {
  throw std::logic_error(name() + ": has no geometric-consistency passes");
}

namespace {

void CheckRange(const char* what, int value, int least, int most) {
  if (value >= least && value <= most) return;
  throw UsageError(std::string(what) + ": expected " + std::to_string(least) + " to " +
                   std::to_string(most) + ", found " + std::to_string(value));
}

}  // namespace

std::unique_ptr<Engine> MakeEngine(const std::string& name, const QualitySettings& quality) {
  CheckRange("neighbours", quality.neighbours, 1, 8);
  CheckRange("neighbours in the passes", quality.pass_neighbours, 1, 8);
  CheckRange("iterations", quality.iterations, 1, 20);
  CheckRange("passes", quality.passes, 0, 8);
  if (name == "sgbm") return std::make_unique<SgbmEngine>(PairLimits{}, quality.neighbours);
  if (name == "patchmatch") return std::make_unique<PatchMatchEngine>(quality);
  throw UsageError("stereo engine: expected one of patchmatch, sgbm, found '" + name + "'");
}

}  // namespace dtr::stereo
