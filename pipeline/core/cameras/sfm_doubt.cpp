#include "pipeline/core/cameras/sfm_doubt.h"

#include "dtr/io/json_fields.h"

namespace dtr::pipeline {

std::optional<Check> SfmDoubtCheck(const DtrSet& set) {
  constexpr char kProvenance[] = "provenance";
  const io::Json provenance = io::ParseJson(set.provenance_json, kProvenance);
  if (!provenance.is_object() || !provenance.contains("calibration")) return std::nullopt;
  const io::Json& calibration = provenance["calibration"];
  if (!calibration.is_object() || !calibration.contains("doubt")) return std::nullopt;
  const io::JsonObject object(calibration, kProvenance, "calibration");
  return AtMost("sfm_doubts", 1, 0,
                "structure from motion is not sure of these cameras: " + object.String("doubt"));
}

}  // namespace dtr::pipeline
