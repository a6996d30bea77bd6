#include "pipeline/core/photo_positions.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/scale.h"
#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

/// Times as far from the middle as half of the places are: a long walk's ends lie within.
constexpr double kFarFromMiddle = 4;

void Add(const std::string& name, const std::optional<io::GpsPosition>& gps,
         PhotoPositions& places) {
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

// A photo without a fix may say latitude 0, longitude 0: east, north and up there are other axes.
// The middle is that of most photos, whatever some say.
size_t PhotoPositions::Origin() const {
  std::vector<Eigen::Vector3d> on_earth;
  for (const io::GpsPosition& place : places) on_earth.push_back(OnEarth(place));
  Eigen::Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& p : on_earth) values.push_back(p[axis]);
    middle[axis] = UpperMedian(values);
  }
  std::vector<double> off_m;
  for (const Eigen::Vector3d& p : on_earth) off_m.push_back((p - middle).norm());
  std::vector<double> sorted = off_m;
  const double limit_m = kFarFromMiddle * UpperMedian(sorted);
  const auto first =
      std::find_if(off_m.begin(), off_m.end(), [limit_m](double off) { return off <= limit_m; });
  return static_cast<size_t>(first - off_m.begin());
}

std::vector<Eigen::Vector3d> PhotoPositions::EastNorthUp() const {
  std::vector<Eigen::Vector3d> positions_m;
  if (places.empty()) return positions_m;
  const io::GpsPosition& origin = places[Origin()];
  const Eigen::Matrix3d axes = calib::EnuFromEarth(origin.latitude_deg, origin.longitude_deg);
  for (const io::GpsPosition& place : places) {
    positions_m.push_back(axes * (OnEarth(place) - OnEarth(origin)));
  }
  return positions_m;
}

std::string PhotoPositions::AxesLine() const {
  return fmt::format("axes: x east, y north, z up, from the position of {}", names[Origin()]);
}

PhotoPositions ReadPhotoPositions(const fs::path& folder, const std::vector<std::string>& names) {
  PhotoPositions places;
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

PhotoPositions PhotoPositionsOf(const capture::Capture& capture,
                                const std::vector<std::string>& names) {
  PhotoPositions places;
  for (const std::string& name : names) {
    const auto photo = std::find_if(capture.photos.begin(), capture.photos.end(),
                                    [&](const capture::Photo& p) { return p.name == name; });
    if (photo != capture.photos.end()) Add(name, photo->gps, places);
  }
  return places;
}

void RequirePlaces(const PhotoPositions& places, const std::string& where,
                   const std::string& whose) {
  if (places.places.size() < calib::kMinPositions) {
    throw Error(
        fmt::format("{}: expected at least {} photos of {} with latitude, longitude and altitude, "
                    "found {}",
                    where, calib::kMinPositions, whose, places.places.size()));
  }
  const auto same_place = [&](const io::GpsPosition& place) {
    return place.latitude_deg == places.places.front().latitude_deg &&
           place.longitude_deg == places.places.front().longitude_deg;
  };
  if (!std::all_of(places.places.begin(), places.places.end(), same_place)) return;
  throw Error(
      fmt::format("{}: all {} photos of {} with GPS give the same latitude and longitude, as after "
                  "a receiver that did not update or a program that cut digits off; leave `gps` "
                  "out, or write the positions into the photos",
                  where, places.places.size(), whose));
}

}  // namespace dtr::pipeline
