#include "calib/validation/report_json.h"
#include "dtr/base/json_number.h"

namespace dtr::calib {

using Json = nlohmann::ordered_json;

Json JsonOf(const PhotosValidation& validation) {
  Json json;
  if (!validation.not_validated.empty()) json["not_validated"] = validation.not_validated;
  json["parts"] = validation.parts;
  json["observations"] = validation.observations;
  json["sigma_px"] = NumberOrNull(validation.sigma_px);
  json["condition"] = NumberOrNull(validation.condition);
  json["halves_ratio"] = NumberOrNull(validation.halves_ratio);
  json["lenses"] = Json::array();
  for (const IntrinsicsValidation& lens : validation.lenses) {
    Json params = Json::array();
    for (size_t k = 0; k < lens.names.size(); ++k) {
      params.push_back({{"name", lens.names[k]},
                        {"stored", NumberOrNull(lens.stored[k])},
                        {"fresh", NumberOrNull(lens.fresh[k])},
                        {"sigma", NumberOrNull(lens.sigma[k])}});
    }
    json["lenses"].push_back({{"difference_sigmas", NumberOrNull(lens.sigmas)},
                              {"moved_px", NumberOrNull(lens.moved_px)},
                              {"params", params}});
  }
  json["cameras"] = Json::array();
  for (const PhotoValidation& camera : validation.cameras) {
    json["cameras"].push_back({{"name", camera.name},
                               {"difference_sigmas", NumberOrNull(camera.sigmas)},
                               {"moved_px", NumberOrNull(camera.moved_px)},
                               {"turn_sigma_rad", NumberOrNull(camera.turn_sigma_rad)},
                               {"centre_sigma", NumberOrNull(camera.centre_sigma)},
                               {"image_shift_px", NumberOrNull(camera.image_shift_px)}});
  }
  json["degeneracies"] = Json::array();
  for (const Degeneracy& d : validation.degeneracies) {
    json["degeneracies"].push_back(
        {{"name", d.name}, {"detail", d.detail}, {"harmful", d.harmful}});
  }
  return json;
}

std::string ToJson(const PhotosValidation& validation) {
  // Names come from files, as in the reports beside this.
  return JsonOf(validation).dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace dtr::calib
