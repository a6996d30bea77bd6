#include "stereo/engine.h"

#include "stereo/patchmatch/patchmatch_engine.h"
#include "stereo/sgbm/sgbm_engine.h"

namespace dtr::stereo {

std::unique_ptr<Engine> MakeEngine(const std::string& name) {
  if (name == "sgbm") return std::make_unique<SgbmEngine>();
  if (name == "patchmatch") return std::make_unique<PatchMatchEngine>();
  throw UsageError("stereo engine: expected one of patchmatch, sgbm, found '" + name + "'");
}

}  // namespace dtr::stereo
