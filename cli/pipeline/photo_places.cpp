#include "cli/pipeline/photo_places.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "calib/scale.h"
#include "dtr/base/error.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

void Add(const std::string& name, const std::optional<io::GpsPosition>& gps, PhotoPlaces& places) {
  if (!gps || !gps->altitude_m) {
    places.without_place.push_back((gps ? "without altitude: " : "without GPS: ") + name);
    return;
  }
  places.names.push_back(name);
  places.places.push_back(*gps);
}

Eigen::Vector3d OnEarth(const io::GpsPosition& p) {
  return calib::EarthFromGeodetic(p.latitude_deg, p.longitude_deg, *p.altitude_m);
}

}  // namespace

std::vector<Eigen::Vector3d> PhotoPlaces::EastNorthUp() const {
  std::vector<Eigen::Vector3d> positions_m;
  if (places.empty()) return positions_m;
  const io::GpsPosition& origin = places.front();
  const Eigen::Matrix3d axes = calib::EnuFromEarth(origin.latitude_deg, origin.longitude_deg);
  for (const io::GpsPosition& place : places) {
    positions_m.push_back(axes * (OnEarth(place) - OnEarth(origin)));
  }
  return positions_m;
}

std::string PhotoPlaces::OriginJson() const {
  const io::GpsPosition& origin = places.front();
  return nlohmann::ordered_json{{"latitude_deg", origin.latitude_deg},
                                {"longitude_deg", origin.longitude_deg},
                                {"altitude_m", *origin.altitude_m}}
      .dump();
}

PhotoPlaces ReadPhotoPlaces(const fs::path& folder, const std::vector<std::string>& names) {
  PhotoPlaces places;
  for (const std::string& name : names) {
    const fs::path photo = folder / name;
    if (fs::is_regular_file(photo)) {
      Add(name, io::ReadImageHeader(photo).gps, places);
    } else {
      places.without_place.push_back("not in the folder: " + name);
    }
  }
  return places;
}

PhotoPlaces PhotoPlacesOf(const capture::Capture& capture, const std::vector<std::string>& names) {
  PhotoPlaces places;
  for (const std::string& name : names) {
    const auto photo = std::find_if(capture.photos.begin(), capture.photos.end(),
                                    [&](const capture::Photo& p) { return p.name == name; });
    if (photo != capture.photos.end()) Add(name, photo->gps, places);
  }
  return places;
}

void RequirePlaces(const PhotoPlaces& places, const std::string& where, const std::string& whose) {
  if (places.places.size() >= calib::kFewestPositions) return;
  throw Error(
      fmt::format("{}: expected at least {} photos of {} with latitude, longitude and altitude, "
                  "found {}",
                  where, calib::kFewestPositions, whose, places.places.size()));
}

}  // namespace dtr::pipeline
