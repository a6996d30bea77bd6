#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/validation/photos.h"

namespace dtr::calib {

std::string ToJson(const PhotosValidation& validation) {
  using Json = nlohmann::ordered_json;
  const auto number = [](double v) { return std::isfinite(v) ? Json(v) : Json(nullptr); };
  Json json;
  if (!validation.not_validated.empty()) json["not_validated"] = validation.not_validated;
  json["parts"] = validation.parts;
  json["observations"] = validation.observations;
  json["sigma_px"] = number(validation.sigma_px);
  json["condition"] = number(validation.condition);
  json["halves_ratio"] = number(validation.halves_ratio);
  json["lenses"] = Json::array();
  for (const IntrinsicsValidation& lens : validation.lenses) {
    Json params = Json::array();
    for (size_t k = 0; k < lens.names.size(); ++k) {
      params.push_back({{"name", lens.names[k]},
                        {"stored", number(lens.stored[k])},
                        {"fresh", number(lens.fresh[k])},
                        {"sigma", number(lens.sigma[k])}});
    }
    json["lenses"].push_back({{"difference_sigmas", number(lens.sigmas)},
                              {"moved_px", number(lens.moved_px)},
                              {"params", params}});
  }
  json["cameras"] = Json::array();
  for (const PhotoValidation& camera : validation.cameras) {
    json["cameras"].push_back({{"name", camera.name},
                               {"difference_sigmas", number(camera.sigmas)},
                               {"moved_px", number(camera.moved_px)},
                               {"turn_sigma_rad", number(camera.turn_sigma_rad)},
                               {"centre_sigma", number(camera.centre_sigma)},
                               {"image_shift_px", number(camera.image_shift_px)}});
  }
  json["degeneracies"] = Json::array();
  for (const Degeneracy& d : validation.degeneracies) {
    json["degeneracies"].push_back(
        {{"name", d.name}, {"detail", d.detail}, {"harmful", d.harmful}});
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace dtr::calib
