#include "pipeline/core/photos/lens_of_photo.h"

#include <map>
#include <nlohmann/json.hpp>

#include "dtr/base/error.h"

namespace dtr::pipeline {
namespace {

using Json = nlohmann::ordered_json;

calib::LensCamera LensFrom(const Json& json) {
  calib::LensCamera lens;
  const auto model = calib::CameraModelFromName(json.at("model").get<std::string>());
  if (!model) throw std::invalid_argument("unknown model");
  lens.model = *model;
  lens.width_px = json.at("width_px").get<int>();
  lens.height_px = json.at("height_px").get<int>();
  lens.params = json.at("params").get<std::vector<double>>();
  lens.Check();
  return lens;
}

}  // namespace

Json LensJson(const calib::LensCamera& lens) {
  return {{"model", calib::NameOf(lens.model)},
          {"width_px", lens.width_px},
          {"height_px", lens.height_px},
          {"params", lens.params}};
}

void AddLenses(const calib::SfmModel& model, Json& provenance) {
  std::map<std::uint32_t, size_t> index;
  std::map<std::string, std::uint32_t> camera_of;
  for (const calib::SfmImage& image : model.images) camera_of[image.name] = image.camera_id;
  provenance["lenses"] = Json::array();
  for (Json& photo : provenance["photos"]) {
    // Held-out photos have no hash, and no depth: nothing of their content enters the provenance.
    if (!photo.contains("sha256")) continue;
    const auto found = camera_of.find(photo.at("name").get<std::string>());
    if (found == camera_of.end()) continue;
    const auto [place, is_new] = index.emplace(found->second, index.size());
    if (is_new) provenance["lenses"].push_back(LensJson(model.cameras.at(found->second)));
    photo["lens"] = place->second;
  }
}

std::optional<calib::LensCamera> LensOfPhoto(const DtrSet& set, const std::string& name) {
  const Json provenance = Json::parse(set.provenance_json, nullptr, false);
  try {
    if (!provenance.is_object() || !provenance.contains("lenses")) return std::nullopt;
    for (const Json& photo : provenance.at("photos")) {
      if (photo.at("name") != name) continue;
      if (!photo.contains("lens")) return std::nullopt;
      return LensFrom(provenance["lenses"].at(photo["lens"].get<size_t>()));
    }
  } catch (const Json::exception& error) {
    throw Error("set.json: provenance: lenses cannot be read: " + std::string(error.what()));
  } catch (const std::invalid_argument& error) {
    throw Error("set.json: provenance: lenses cannot be read: " + std::string(error.what()));
  }
  return std::nullopt;
}

}  // namespace dtr::pipeline
