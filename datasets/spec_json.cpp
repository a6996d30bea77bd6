// datasets/spec_json.cpp -- dataset.json, the recipe of a collection.
#include <cmath>
#include <nlohmann/json.hpp>

#include "datasets/make.h"
#include "dtr/base/error.h"
#include "dtr/io/json_fields.h"

namespace dtr::datasets {
namespace {

using Json = nlohmann::ordered_json;

// Grows when the same spec begins to give other images.
constexpr int kGeneratorVersion = 1;
constexpr char kFisheye[] = "RADIAL_FISHEYE";

// The beginning of a wrong value, whatever its strings hold.
std::string Shown(const Json& value) {
  constexpr size_t kMax = 60;
  const std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  return text.size() > kMax ? text.substr(0, kMax) + "..." : text;
}

/// The member `key` as T; throws Error naming it when it is absent or of another kind.
template <typename T>
T FieldOf(const Json& object, const char* key, bool (Json::*is)() const noexcept,
          const char* expected, const std::string& source) {
  const auto found = object.find(key);
  if (found == object.end() || !((*found).*is)()) {
    throw Error(source + ": " + key + ": expected " + expected + ", found " +
                (found == object.end() ? "nothing" : Shown(*found)));
  }
  return found->get<T>();
}

double NumberOf(const Json& object, const char* key, const std::string& source) {
  return FieldOf<double>(object, key, &Json::is_number, "a number", source);
}

int IntOf(const Json& object, const char* key, const std::string& source) {
  const auto value =
      FieldOf<std::int64_t>(object, key, &Json::is_number_integer, "a whole number", source);
  if (value < 0 || value > 1'000'000) {
    throw Error(source + ": " + key + ": expected 0 to 1000000, found " + std::to_string(value));
  }
  return static_cast<int>(value);
}

}  // namespace

std::string FormatSpecJson(const DatasetSpec& spec) {
  Json json;
  json["generator"] = "dtr dataset make";
  json["generator_version"] = kGeneratorVersion;
  json["scene"] = spec.scene;
  json["layout"] = spec.layout;
  json["views"] = spec.views;
  json["width_px"] = spec.width_px;
  json["height_px"] = spec.height_px;
  json["focal_35mm"] = spec.focal_35mm;
  json["supersampling"] = spec.supersampling;
  json["noise_levels"] = spec.noise;
  json["exposure_drift_stops"] = spec.exposure_drift;
  json["lens"] = {{"model", spec.fisheye ? kFisheye : "RADIAL"}, {"k1", spec.k1}, {"k2", spec.k2}};
  json["seed"] = spec.seed;
  json["world_offset"] = {spec.world_offset.x(), spec.world_offset.y(), spec.world_offset.z()};
  json["scale"] = spec.scale;
  json["jpeg_quality"] = spec.jpeg_quality;
  if (spec.panoramas) json["panoramas"] = true;
  if (spec.time_s != 0) json["time_s"] = spec.time_s;  // still scenes have no time
  if (spec.steps > 1) {
    json["steps"] = spec.steps;
    json["steps_per_second"] = spec.steps_per_second;
    json["videos"] = spec.videos;
  }
  return json.dump(2) + "\n";
}

DatasetSpec ParseSpecJson(const std::string& text, const std::string& source) {
  const Json json = io::ParseJson(text, source);
  if (!json.is_object()) {
    throw Error(source + ": expected a JSON object as `dtr dataset make` writes it, found " +
                json.type_name());
  }
  const int version = IntOf(json, "generator_version", source);
  if (version != kGeneratorVersion) {
    throw Error(source + ": generator_version: expected " + std::to_string(kGeneratorVersion) +
                ", found " + std::to_string(version) +
                "; the same images need the version of dtr that made them");
  }
  DatasetSpec spec;
  spec.scene = FieldOf<std::string>(json, "scene", &Json::is_string, "a name", source);
  spec.layout = FieldOf<std::string>(json, "layout", &Json::is_string, "a name", source);
  spec.views = IntOf(json, "views", source);
  spec.width_px = IntOf(json, "width_px", source);
  spec.height_px = IntOf(json, "height_px", source);
  spec.focal_35mm = NumberOf(json, "focal_35mm", source);
  spec.supersampling = IntOf(json, "supersampling", source);
  spec.noise = NumberOf(json, "noise_levels", source);
  spec.exposure_drift = NumberOf(json, "exposure_drift_stops", source);
  const Json lens = FieldOf<Json>(json, "lens", &Json::is_object, "an object", source);
  spec.fisheye = lens.value("model", Json()) == kFisheye;
  spec.k1 = NumberOf(lens, "k1", source);
  spec.k2 = NumberOf(lens, "k2", source);
  spec.seed = FieldOf<std::uint64_t>(json, "seed", &Json::is_number_unsigned,
                                     "a whole number, 0 or more", source);
  const Json offset = FieldOf<Json>(json, "world_offset", &Json::is_array, "three numbers", source);
  if (offset.size() != 3 || !offset[0].is_number() || !offset[1].is_number() ||
      !offset[2].is_number()) {
    throw Error(source + ": world_offset: expected three numbers, found " + Shown(offset));
  }
  for (int k = 0; k < 3; ++k) spec.world_offset[k] = offset[static_cast<size_t>(k)].get<double>();
  spec.scale = NumberOf(json, "scale", source);
  spec.jpeg_quality = IntOf(json, "jpeg_quality", source);
  if (json.contains("panoramas")) {
    spec.panoramas = FieldOf<bool>(json, "panoramas", &Json::is_boolean, "true or false", source);
  }
  if (json.contains("time_s")) spec.time_s = NumberOf(json, "time_s", source);
  if (json.contains("steps")) {
    spec.steps = IntOf(json, "steps", source);
    spec.steps_per_second = IntOf(json, "steps_per_second", source);
    spec.videos = FieldOf<bool>(json, "videos", &Json::is_boolean, "true or false", source);
  }
  return spec;
}

}  // namespace dtr::datasets
