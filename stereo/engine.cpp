#include "stereo/engine.h"

#include "stereo/sgbm/sgbm_engine.h"

namespace dtr::stereo {

std::unique_ptr<Engine> MakeEngine(const std::string& name) {
  if (name == "sgbm") return std::make_unique<SgbmEngine>();
  throw UsageError("stereo engine: expected one of sgbm, found '" + name + "'");
}

}  // namespace dtr::stereo
