// pipeline/core/photos/lens_of_photo.h -- the camera models with distortion that photos were
// taken with, in a set's provenance.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "calib/sfm_model.h"
#include "dtr/types/dtr_set.h"

namespace dtr::pipeline {

/// {"model", "width_px", "height_px", "params"}, in COLMAP's words.
nlohmann::ordered_json LensJson(const calib::LensCamera& lens);

/// Adds `lenses` to a provenance, and `lens`, an index into them, to each of its `photos` that the
/// model has an image of by name. Held-out photos, which have no hash there, get none.
void AddLenses(const calib::SfmModel& model, nlohmann::ordered_json& provenance);

/// What AddLenses wrote of a photo; empty where the set does not know. Throws Error for a damaged
/// entry.
std::optional<calib::LensCamera> LensOfPhoto(const DtrSet& set, const std::string& name);

}  // namespace dtr::pipeline
