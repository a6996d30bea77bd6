#include "pipeline/core/cameras/point_conventions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "calib/lens_map.h"
#include "calib/residuals.h"
#include "dtr/base/order_statistics.h"
#include "pipeline/core/cameras/camera_distortion.h"

namespace dtr::pipeline {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr size_t kMaxObservations = 4000, kMinObservations = 6;
constexpr double kMinSigmas = 6;
constexpr double kFarShare = 0.25;     // of the long side: beyond, a residual says no more
constexpr double kMinScalePx = 0.3;    // of Cauchy's loss
constexpr double kMinGainShare = 0.9;  // of the median residual
constexpr double kMinGainPx = 0.05;    // less no feature can tell
constexpr double kMaxOffCentre = 0.1;  // of the sides, a principal point from the middle
constexpr double kFitsShare = 0.005, kFitsPx = 2;  // of the long side: cameras fit their points

struct Observation {
  size_t camera = 0;  // in `placed`
  Vector3d p_in_world;
  Vector2d pixel;  // of the file
};

// Some of all observations, evenly.
std::vector<Observation> SomeObservations(const io::ForeignScene& scene,
                                          const std::vector<size_t>& place) {
  size_t all = 0;
  for (const io::ForeignPoint& point : scene.points) all += point.seen.size();
  const size_t step = std::max<size_t>(1, (all + kMaxObservations - 1) / kMaxObservations);
  std::vector<Observation> some;
  size_t i = 0;
  for (const io::ForeignPoint& point : scene.points) {
    for (const auto& [camera, pixel] : point.seen) {
      if (i++ % step != 0 || place[camera] == kNotPlaced) continue;
      some.push_back({place[camera], point.p_in_world, pixel});
    }
  }
  return some;
}

enum class Origin { kOwn, kMiddle, kCorner, kLowerCorner, kPrincipal };
enum class Lens { kOwn, kProjected, kProjectedNegated, kMeasured, kMeasuredNegated, kPerPixel };

// How a file may be meant.
struct Convention {
  Origin origin = Origin::kOwn;
  Lens lens = Lens::kOwn;
  bool y_up = false;    // of pixels, against the format
  bool turned = false;  // cameras with y and z negated, against the format

  bool FromCorner() const { return origin == Origin::kCorner || origin == Origin::kLowerCorner; }
  bool IsColmapsNvm() const {
    return origin == Origin::kCorner && !y_up && !turned &&
           (lens == Lens::kOwn || lens == Lens::kProjectedNegated);
  }
};

// The format's own first, then COLMAP's, so that what is in use is preferred to what might be.
std::vector<Convention> AllConventions() {
  std::vector<Convention> conventions = {{}, {Origin::kCorner, Lens::kProjectedNegated}};
  for (const bool turned : {false, true}) {
    for (const bool y_up : {false, true}) {
      for (const Origin origin : {Origin::kOwn, Origin::kMiddle, Origin::kCorner,
                                  Origin::kLowerCorner, Origin::kPrincipal}) {
        for (const Lens lens : {Lens::kOwn, Lens::kProjectedNegated, Lens::kProjected,
                                Lens::kMeasured, Lens::kMeasuredNegated, Lens::kPerPixel}) {
          conventions.push_back({origin, lens, y_up, turned});
        }
      }
    }
  }
  return conventions;
}

// Radial coefficients of a camera and whether they are of the measured point; empty: it has none
// that a program could mean otherwise.
struct Radial {
  bool measured = false;
  double k1 = 0, k2 = 0;
};

std::optional<Radial> RadialOf(const io::NamedCamera& named) {
  if (!named.distortion) return std::nullopt;
  const std::vector<double>& p = named.distortion->params;
  if (named.distortion->model == "INVERSE_RADIAL") return Radial{true, p[4], 0};
  if (named.distortion->model == "OPENCV") return Radial{false, p[4], p[5]};
  return std::nullopt;
}

void SetRadial(const Radial& radial, io::NamedCamera& named) {
  const PinholeCamera& k = named.camera;
  std::vector<double> params = {k.fx_px(), k.fy_px(), k.cx_px(), k.cy_px(), radial.k1};
  if (!radial.measured) params.insert(params.end(), {radial.k2, 0, 0});
  named.distortion = io::Distortion{radial.measured ? "INVERSE_RADIAL" : "OPENCV", params};
}

// False where the convention does not apply to the camera's distortion, or says the same as its
// own.
bool SetLens(Lens lens, io::NamedCamera& named) {
  if (lens == Lens::kOwn) return true;
  const auto own = RadialOf(named);
  if (!own) return false;
  const bool measured =
      lens == Lens::kMeasured || lens == Lens::kMeasuredNegated || lens == Lens::kPerPixel;
  const bool negated = lens == Lens::kProjectedNegated || lens == Lens::kMeasuredNegated;
  if (measured && own->k2 != 0) return false;  // the formula has one coefficient
  if (lens != Lens::kPerPixel && measured == own->measured && !negated) return false;
  Radial radial{measured, own->k1, own->k2};
  if (negated) radial = {measured, -own->k1, -own->k2};
  if (lens == Lens::kPerPixel) radial.k1 *= named.camera.fx_px() * named.camera.fx_px();
  if (!std::isfinite(radial.k1)) return false;
  SetRadial(radial, named);
  return true;
}

// False where the camera's pixels count from there anyway.
bool SetOrigin(Origin origin, PlacedCamera& camera) {
  const PinholeCamera& k = camera.named.camera;
  const Vector2d size(k.width_px(), k.height_px()), before = camera.shift;
  if (origin == Origin::kOwn) return true;
  if (origin == Origin::kMiddle) camera.shift = size / 2;
  if (origin == Origin::kCorner) camera.shift.setZero();
  if (origin == Origin::kLowerCorner) camera.shift = {0, size.y()};
  if (origin == Origin::kPrincipal) camera.shift = {k.cx_px(), k.cy_px()};
  return camera.shift != before;
}

// The cameras taken so; empty where another convention means the same.
std::optional<std::vector<PlacedCamera>> Taken(const Convention& convention,
                                               std::vector<PlacedCamera> cameras) {
  const Pose half_turn{Eigen::Quaterniond(0, 1, 0, 0), Vector3d::Zero()};  // about x
  bool has_lens = false, has_origin = false;
  for (PlacedCamera& camera : cameras) {
    has_lens |= SetLens(convention.lens, camera.named);
    has_origin |= SetOrigin(convention.origin, camera);
    camera.y_up = camera.y_up != convention.y_up;
    if (convention.turned) camera.named.cam_from_world = half_turn * camera.named.cam_from_world;
  }
  if (!has_lens || !has_origin) return std::nullopt;
  return cameras;
}

// From where the file says that a photo shows a point to where the camera sees it, at most a share
// of the image; empty: it does not see it.
using Residuals = std::vector<std::optional<Vector2d>>;

Residuals ResidualsOf(const std::vector<Observation>& observations,
                      const std::vector<PlacedCamera>& cameras) {
  std::map<size_t, calib::LensMap> lenses;
  Residuals residuals;
  for (const Observation& seen : observations) {
    const PlacedCamera& camera = cameras[seen.camera];
    auto lens = lenses.find(seen.camera);
    if (lens == lenses.end()) {
      lens = lenses.emplace(seen.camera, calib::LensMap(CameraModelOf(camera.named))).first;
    }
    const auto pixel = lens->second.PixelFromCam(camera.named.cam_from_world * seen.p_in_world);
    residuals.push_back(pixel ? std::optional<Vector2d>(*pixel - camera.PhotoPixel(seen.pixel))
                              : std::nullopt);
  }
  return residuals;
}

std::vector<double> Lengths(const Residuals& residuals, double far_px) {
  std::vector<double> lengths;
  for (const auto& residual : residuals) {
    lengths.push_back(residual ? std::min(residual->norm(), far_px) : far_px);
  }
  return lengths;
}

double Median(std::vector<double> values) { return UpperMedian(values); }

// Whether residuals became smaller beyond chance.
bool AreSmaller(const std::vector<double>& now, const std::vector<double>& before) {
  const double median = Median(now), median_before = Median(before);
  if (!(median <= kMinGainShare * median_before)) return false;
  if (!(median_before - median >= kMinGainPx)) return false;
  const double scale_px = std::max(kMinScalePx, median);
  const auto [mean, deviation] = calib::DecreaseOfLoss(before, now, scale_px);
  return mean > 0 && mean > kMinSigmas * deviation;
}

// Moves principal points to where the measurements of their cameras say: those of equal intrinsics
// together.
void TakePrincipalPoints(const std::vector<Observation>& observations, const Residuals& residuals,
                         std::vector<PlacedCamera>& cameras) {
  const auto key_of = [](const io::NamedCamera& named) {
    const PinholeCamera& k = named.camera;
    std::vector<double> key = {k.fx_px(), k.fy_px(), double(k.width_px()), double(k.height_px())};
    if (named.distortion) {
      key.insert(key.end(), named.distortion->params.begin(), named.distortion->params.end());
    }
    return key;
  };
  std::map<std::vector<double>, std::pair<std::vector<double>, std::vector<double>>> offsets;
  for (size_t i = 0; i < observations.size(); ++i) {
    if (!residuals[i]) continue;
    auto& [x, y] = offsets[key_of(cameras[observations[i].camera].named)];
    x.push_back(residuals[i]->x());
    y.push_back(residuals[i]->y());
  }
  for (PlacedCamera& camera : cameras) {
    const auto found = offsets.find(key_of(camera.named));
    if (found == offsets.end() || found->second.first.size() < kMinObservations) continue;
    const PinholeCamera k = camera.named.camera;
    const Vector2d centre(k.cx_px() - UpperMedian(found->second.first),
                          k.cy_px() - UpperMedian(found->second.second));
    const Eigen::Array2d size(k.width_px(), k.height_px());
    if (((centre.array() / size - 0.5).abs() > kMaxOffCentre).any()) continue;
    camera.named.camera =
        PinholeCamera(k.width_px(), k.height_px(), k.fx_px(), k.fy_px(), centre.x(), centre.y());
    if (!camera.named.distortion) continue;
    camera.named.distortion->params[2] = centre.x();
    camera.named.distortion->params[3] = centre.y();
  }
}

std::string NameOf(const Convention& convention) {
  static const std::map<Origin, const char*> kOrigins = {
      {Origin::kMiddle, "pixels from the image's middle"},
      {Origin::kCorner, "pixels from the image's corner"},
      {Origin::kLowerCorner, "pixels from the image's lower left corner"},
      {Origin::kPrincipal, "pixels from the principal point"}};
  static const std::map<Lens, const char*> kLenses = {
      {Lens::kProjected, "distortion of the projected point"},
      {Lens::kProjectedNegated, "distortion of the projected point with the sign changed"},
      {Lens::kMeasured, "distortion of the measured point"},
      {Lens::kMeasuredNegated, "distortion of the measured point with the sign changed"},
      {Lens::kPerPixel, "distortion per pixel instead of per focal length"}};
  std::string name;
  const auto add = [&](const char* part) {
    name += (name.empty() ? "" : ", ") + std::string(part);
  };
  if (convention.origin != Origin::kOwn) add(kOrigins.at(convention.origin));
  if (convention.y_up) add("y the other way up");
  if (convention.turned) add("cameras that look the other way along z, with y turned, too");
  if (convention.lens != Lens::kOwn) add(kLenses.at(convention.lens));
  return name;
}

struct Found {
  Convention convention;
  bool has_own_centres = false;  // principal points are those of the pixels
  std::vector<PlacedCamera> cameras;
  std::vector<double> lengths;
};

// The cameras taken so; where pixels count from a corner with the principal points that they have,
// if these are others than the file's beyond chance.
std::optional<Found> TakenSo(const Convention& convention,
                             const std::vector<Observation>& observations,
                             const std::vector<PlacedCamera>& placed, double far_px) {
  auto cameras = Taken(convention, placed);
  if (!cameras) return std::nullopt;
  const Residuals residuals = ResidualsOf(observations, *cameras);
  Found found{convention, false, std::move(*cameras), Lengths(residuals, far_px)};
  if (!convention.FromCorner()) return found;
  Found centred{convention, true, found.cameras, {}};
  TakePrincipalPoints(observations, residuals, centred.cameras);
  centred.lengths = Lengths(ResidualsOf(observations, centred.cameras), far_px);
  return AreSmaller(centred.lengths, found.lengths) ? centred : found;
}

// The convention that fits best, the format's own unless another is better beyond chance.
Found BestWay(const std::vector<Observation>& observations, const std::vector<PlacedCamera>& placed,
              double far_px, double fits_px) {
  Found best{{}, false, placed, Lengths(ResidualsOf(observations, placed), far_px)};
  for (const Convention& convention : AllConventions()) {
    auto found = TakenSo(convention, observations, placed, far_px);
    if (!found || !(Median(found->lengths) <= fits_px)) continue;
    if (AreSmaller(found->lengths, best.lengths)) best = std::move(*found);
  }
  return best;
}

}  // namespace

std::string SettleConventions(const io::ForeignScene& scene, const std::string& source,
                              const std::vector<size_t>& place, std::vector<PlacedCamera>& placed) {
  if (scene.conventions_of.empty() || placed.empty()) return "";
  const std::vector<Observation> observations = SomeObservations(scene, place);
  if (observations.size() < kMinObservations) return "";
  const PinholeCamera& first = placed.front().named.camera;
  const double side_px = std::max(first.width_px(), first.height_px());
  const double far_px = kFarShare * side_px, fits_px = std::max(kFitsPx, kFitsShare * side_px);
  const double own_px = Median(Lengths(ResidualsOf(observations, placed), side_px));
  Found best = BestWay(observations, placed, far_px, fits_px);
  const std::string name = NameOf(best.convention);
  if (name.empty()) return "";
  const char* also = best.has_own_centres ? ", principal points as these pixels have them" : "";
  placed = std::move(best.cameras);
  const bool colmaps = scene.conventions_of == "VisualSFM" && best.convention.IsColmapsNvm();
  return fmt::format(
      "{}: its points lie {:.2g} px from where its cameras see them with {}{}{}; {}{:.3g} px as {} "
      "writes this format (median of {})",
      source, Median(best.lengths), name, also, colmaps ? ", as COLMAP writes it" : "",
      own_px < side_px ? "" : "more than ", own_px, scene.conventions_of, observations.size());
}

}  // namespace dtr::pipeline
