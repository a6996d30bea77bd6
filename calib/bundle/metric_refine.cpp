#include "calib/bundle/metric_refine.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/bundle/covariance.h"
#include "calib/bundle/held_out.h"
#include "calib/scale.h"
#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"

namespace dtr::calib {
namespace {

constexpr int kMaxTriedPoints = 4000;    // that decide which places agree
constexpr double kSettledSpread = 0.05;  // relative change of a standard deviation
constexpr double kMinSigmaM = 1e-3;      // nobody knows a place on Earth better
constexpr double kMaxOff = 5;            // standard deviations of a distance
// What a model may be longer at one end than at the other before anything is adjusted.
constexpr double kScaleDrift = 0.02;

Eigen::Vector3d CentreOf(const SfmModel& model, int image) {
  return model.images[static_cast<size_t>(image)].cam_from_world.TargetOriginInSource();
}

double DistanceOf(const SfmModel& model, const KnownDistance& d) {
  return (CentreOf(model, d.image_a) - CentreOf(model, d.image_b)).norm();
}

double SigmaOf(const KnownDistance& d) {
  return d.sigma_m > 0 ? d.sigma_m : kUnstatedRelativeSigma * d.length_m;
}

// Root sum of squared distances from the mean.
double SpreadOf(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  double squares = 0;
  for (const Eigen::Vector3d& p : points) squares += (p - mean).squaredNorm();
  return std::sqrt(squares);
}

SfmModel Moved(SfmModel model, const Similarity& b_from_a) {
  for (SfmImage& image : model.images) {
    image.cam_from_world = b_from_a.CamFromB(image.cam_from_world);
  }
  for (auto& [id, point] : model.points) point.p_in_world = b_from_a * point.p_in_world;
  return model;
}

// Centres of the cameras whose place is known, and these places: where `used` says so.
struct Pairs {
  std::vector<Eigen::Vector3d> centres, positions_m;
};

Pairs PairsOf(const SfmModel& model, const KnownMetres& known, const std::vector<bool>& used) {
  Pairs pairs;
  for (size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    pairs.centres.push_back(CentreOf(model, known.places[i].image));
    pairs.positions_m.push_back(known.places[i].position_m);
  }
  return pairs;
}

// Which places agree, and how far those err that do not say so.
struct Agreement {
  std::vector<bool> used;
  double sigma_flat_m = kMinSigmaM, sigma_up_m = kMinSigmaM;

  Eigen::Vector3d SigmaOf(const KnownPlace& place) const {
    const double flat = place.sigma_flat_m > 0 ? place.sigma_flat_m : sigma_flat_m;
    return {flat, flat, place.sigma_up_m > 0 ? place.sigma_up_m : sigma_up_m};
  }
};

std::vector<PositionPrior> PositionsOf(const KnownMetres& known, const Agreement& agreement) {
  std::vector<PositionPrior> positions;
  for (size_t i = 0; i < known.places.size(); ++i) {
    const KnownPlace& place = known.places[i];
    if (agreement.used[i])
      positions.push_back({place.image, place.position_m, agreement.SigmaOf(place)});
  }
  return positions;
}

void RequireEnough(const Agreement& agreement) {
  const auto agree =
      static_cast<size_t>(std::count(agreement.used.begin(), agreement.used.end(), true));
  if (agree >= kMinPositions && 2 * agree >= agreement.used.size()) return;
  throw Error(
      fmt::format("GPS: expected positions that agree with the cameras, found that {} of {} do",
                  agree, agreement.used.size()));
}

// What a position leaves of its error as its camera follows it, per place and axis: 1 where
// observations decide, 0 where nothing else does (Helmert's redundancy numbers). Where the
// covariance is too large to be worked out, the numbers of a similarity alone are counted (seven,
// six where distances hold the scale), and errors come out too small by what the model bends.
std::vector<Eigen::Vector3d> Redundancies(const KnownMetres& known, const Agreement& agreement,
                                          const BundleCovariance* covariance) {
  const auto agree =
      static_cast<double>(std::count(agreement.used.begin(), agreement.used.end(), true));
  const double absorbed = known.distances.empty() ? 7 : 6;
  std::vector<Eigen::Vector3d> shares(known.places.size(),
                                      Eigen::Vector3d::Constant(1 - absorbed / (3 * agree)));
  if (covariance == nullptr || !covariance->computed || !covariance->determined) return shares;
  for (size_t i = 0; i < shares.size(); ++i) {
    const Eigen::Vector3d variance =
        covariance->OfImage(known.places[i].image).diagonal().tail<3>();
    const Eigen::Vector3d sigma = agreement.SigmaOf(known.places[i]);
    shares[i] = (1 - (variance.array() / sigma.array().square())).cwiseMax(0);
  }
  return shares;
}

// By what the cameras, as they are now, miss their places.
Agreement Reweighted(const KnownMetres& known, const std::vector<Eigen::Vector3d>& misses,
                     Agreement agreement, const BundleCovariance* covariance) {
  const std::vector<Eigen::Vector3d> shares = Redundancies(known, agreement, covariance);
  double flat = 0, up = 0, flat_count = 0, up_count = 0;
  for (size_t i = 0; i < misses.size(); ++i) {
    if (!agreement.used[i]) continue;
    if (!(known.places[i].sigma_flat_m > 0)) {
      flat += misses[i].head<2>().squaredNorm();
      flat_count += shares[i].head<2>().sum();
    }
    if (!(known.places[i].sigma_up_m > 0)) {
      up += misses[i].z() * misses[i].z();
      up_count += shares[i].z();
    }
  }
  if (flat_count > 0) agreement.sigma_flat_m = std::max(kMinSigmaM, std::sqrt(flat / flat_count));
  if (up_count > 0) agreement.sigma_up_m = std::max(kMinSigmaM, std::sqrt(up / up_count));
  std::vector<double> lengths;
  for (size_t i = 0; i < misses.size(); ++i) {
    lengths.push_back(misses[i].cwiseQuotient(agreement.SigmaOf(known.places[i])).norm());
  }
  std::vector<double> sorted = lengths;
  const double limit = kPositionOutlierSigmas * std::max(1.0, UpperMedian(sorted) / kMedianLength);
  for (size_t i = 0; i < lengths.size(); ++i) agreement.used[i] = lengths[i] <= limit;
  return agreement;
}

bool IsSettled(const Agreement& before, const Agreement& now) {
  const auto same = [](double a, double b) { return std::abs(std::log(b / a)) <= kSettledSpread; };
  return before.used == now.used && same(before.sigma_flat_m, now.sigma_flat_m) &&
         same(before.sigma_up_m, now.sigma_up_m);
}

template <typename Model>
std::vector<Eigen::Vector3d> Misses(const KnownMetres& known, const Model& model) {
  std::vector<Eigen::Vector3d> misses;
  for (const KnownPlace& place : known.places) {
    const Pose& pose = model.images[static_cast<size_t>(place.image)].cam_from_world;
    misses.push_back(pose.TargetOriginInSource() - place.position_m);
  }
  return misses;
}

Similarity FromDistances(const SfmModel& model, const KnownMetres& known) {
  std::vector<MeasuredDistance> measured;
  for (const KnownDistance& d : known.distances) {
    // Each end errs by the drift: distances in two places of a model may differ by as much.
    const double drift = kScaleDrift * DistanceOf(model, d) / std::sqrt(2);
    const Eigen::Matrix3d covariance = drift * drift * Eigen::Matrix3d::Identity();
    measured.push_back({d.name, CentreOf(model, d.image_a), CentreOf(model, d.image_b), covariance,
                        covariance, d.length_m, SigmaOf(d)});
  }
  Similarity metric_from_model;
  metric_from_model.scale = ScaleFromDistances(measured).metres_per_unit;
  return metric_from_model;
}

// Each distance against what the places make of it.
void RequireAgreement(const SfmModel& model, const KnownMetres& known,
                      const PositionScale& places) {
  for (const KnownDistance& d : known.distances) {
    const double by_gps = places.metric_from_scene.scale * DistanceOf(model, d);
    // Not of its logarithm: of places that err by more than the cameras stand apart the scale is a
    // number of which nothing but its error is known.
    const double sigma =
        std::hypot(by_gps * places.relative_sigma, SigmaOf(d), by_gps * kScaleDrift);
    const double off = std::abs(d.length_m - by_gps) / sigma;
    if (off <= kMaxOff) continue;
    throw Error(fmt::format(
        "{}: expected a distance that agrees with the photos' GPS, found {:.4g} m between these "
        "cameras by GPS, {:.1f} standard deviations off; is it the right pair?",
        d.name, by_gps, off));
  }
}

// Heights by satellite err by more than places on the map. Where they do not say how far, no less
// is believed of them, however well a few of them agree.
Eigen::Vector3d Believed(const KnownPlace& place, Eigen::Vector3d sigma) {
  if (!(place.sigma_up_m > 0)) sigma.z() = std::max(sigma.z(), sigma.x());
  return sigma;
}

// How far the places that agree err: as they say, where they do, else as `found` says; never less.
std::vector<Eigen::Vector3d> ErrorsOf(const KnownMetres& known, const std::vector<bool>& agree,
                                      double found) {
  std::vector<Eigen::Vector3d> sigmas;
  for (size_t i = 0; i < agree.size(); ++i) {
    const double flat = std::max({found, known.places[i].sigma_flat_m, kMinSigmaM});
    const double up = std::max({found, known.places[i].sigma_up_m, kMinSigmaM});
    if (agree[i]) sigmas.push_back(Believed(known.places[i], {flat, flat, up}));
  }
  return sigmas;
}

// The way into metres, and the places that agree with it.
Similarity FromPlaces(const SfmModel& model, const KnownMetres& known, Agreement& agreement,
                      MetricReport& report) {
  const Pairs pairs = PairsOf(model, known, std::vector<bool>(known.places.size(), true));
  PositionScale placed = AlignToPositions(pairs.centres, pairs.positions_m);
  if (known.distances.empty()) RequireKnownScale(placed);
  std::vector<bool> agree(known.places.size(), true);
  for (const size_t i : placed.left_out) agree[i] = false;
  FillUncertainty(PairsOf(model, known, agree).centres, ErrorsOf(known, agree, placed.sigma_m),
                  placed);
  RequireAgreement(model, known, placed);
  report.places_tell_scale = known.distances.empty() || placed.relative_sigma <= kMaxRelativeSigma;
  if (!report.places_tell_scale) {
    placed = AlignToPositions(pairs.centres, pairs.positions_m, FromDistances(model, known).scale);
  }
  agreement.used.assign(known.places.size(), true);
  for (const size_t i : placed.left_out) agreement.used[i] = false;
  return placed.metric_from_scene;
}

// Turns and shifts the model to places that tell no more: held, they would bend nothing that photos
// tell, and a solve finds a turn that is worth no more than theirs in very many steps.
Agreement TurnToPlaces(const KnownMetres& known, Agreement agreement, MetricStart& start) {
  for (int pass = 0; pass < known.max_passes; ++pass) {
    const Agreement next = Reweighted(known, Misses(known, start.model), agreement, nullptr);
    RequireEnough(next);
    start.report.passes = pass + 1;
    start.report.settled = pass > 0 && IsSettled(agreement, next);
    if (start.report.settled) break;
    agreement = next;
    const Pairs pairs = PairsOf(start.model, known, agreement.used);
    std::vector<Eigen::Vector3d> sigmas;
    for (const PositionPrior& p : PositionsOf(known, agreement)) sigmas.push_back(p.sigma);
    start.model = Moved(start.model, TurnAndShift(pairs.centres, pairs.positions_m, sigmas));
  }
  return agreement;
}

void RequireNoContradiction(const Adjusted& fixed, const Adjusted& free) {
  if (!Contradicts(fixed, free)) return;
  throw Error(fmt::format(
      "bundle adjustment: expected photos that agree with the positions and distances given, found "
      "residuals of {:.2f} px per coordinate and {} observations that agree with these fixed, "
      "{:.2f} px and {} without; are their standard deviations too small, or is a distance of "
      "another pair?",
      fixed.sigma_px, fixed.observations, free.sigma_px, free.observations));
}

// Adjusts some points until the places settle, and holds what comes out against the photos.
void SettlePlaces(const KnownMetres& known, MetricStart& start, Agreement agreement) {
  const RefineOptions& options = start.options;
  // Of the lenses as they are known: what decides about places is to see what the result will.
  const SfmModel model =
      options.known_lenses ? WithLenses(start.model, *options.known_lenses) : start.model;
  const Bundle some =
      SomePoints(BundleOf(model, options.separate_lenses), kMaxTriedPoints, options.seed);
  AdjustOptions adjust =
      OptionsFor(options.known_lenses ? LensFreedom::kFixed : LensFreedom::kNoPrincipalPoint);
  adjust.progress = options.progress;
  const Adjusted free = Adjust(some, adjust);
  adjust.distances = options.distances;
  Bundle bundle = some;
  const bool placed = !known.places.empty() && start.report.places_tell_scale;
  if (placed) agreement = Reweighted(known, Misses(known, bundle), agreement, nullptr);
  for (int pass = 0; pass < known.max_passes; ++pass) {
    if (placed) RequireEnough(agreement);
    if (placed) adjust.positions = PositionsOf(known, agreement);
    const Adjusted adjusted = Adjust(bundle, adjust);
    bundle = adjusted.bundle;
    Agreement next = agreement;
    if (placed) {
      const BundleCovariance covariance = CovarianceOf(adjusted, adjust);
      next = Reweighted(known, Misses(known, bundle), agreement, &covariance);
    }
    const bool settled = IsSettled(agreement, next);
    if (placed) {
      start.report.passes = pass + 1;
      start.report.settled = settled;
    }
    if (settled || pass + 1 == known.max_passes) {
      RequireNoContradiction(adjusted, free);
      break;
    }
    agreement = next;
  }
  start.places = PositionsOf(known, agreement);
  if (placed) start.options.positions = start.places;
  for (size_t i = 0; i < known.places.size(); ++i) {
    const KnownPlace& place = known.places[i];
    if (!agreement.used[i]) start.report.left_out.push_back(place.image);
    if (!(place.sigma_flat_m > 0)) start.report.sigma_flat_m = agreement.sigma_flat_m;
    if (!(place.sigma_up_m > 0)) start.report.sigma_up_m = agreement.sigma_up_m;
  }
}

// By how much places err more than they say, all in all; at least 1. `misses` of a model that has
// taken up the numbers of a similarity at least.
double Understated(const std::vector<Eigen::Vector3d>& misses,
                   const std::vector<Eigen::Vector3d>& sigmas) {
  double squares = 0;
  for (size_t i = 0; i < misses.size(); ++i) {
    squares += misses[i].cwiseQuotient(sigmas[i]).squaredNorm();
  }
  return std::max(1.0, std::sqrt(squares / (3.0 * static_cast<double>(misses.size()) - 7)));
}

// What is reported of the positions.
void CompletePlaces(const KnownMetres& known, const SfmModel& adjusted, MetricStart& start) {
  MetricReport& report = start.report;
  std::vector<bool> used(known.places.size());
  for (size_t i = 0; i < used.size(); ++i) {
    const auto& out = report.left_out;
    used[i] = std::find(out.begin(), out.end(), known.places[i].image) == out.end();
  }
  const Pairs given = PairsOf(start.model, known, used), found = PairsOf(adjusted, known, used);
  const Similarity as_a_whole = report.places_tell_scale
                                    ? AlignPoints(given.centres, given.positions_m)
                                    : AlignPointsAtScale(given.centres, given.positions_m, 1);
  report.given_rms_m = AlignmentRms(as_a_whole, given.centres, given.positions_m);
  report.rms_m = AlignmentRms({}, found.centres, found.positions_m);
  std::vector<Eigen::Vector3d> misses, sigmas;
  for (size_t i = 0, k = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    misses.push_back(found.centres[k] - found.positions_m[k]);
    sigmas.push_back(Believed(known.places[i], start.places[k++].sigma));
  }
  const double factor = Understated(misses, sigmas);
  for (Eigen::Vector3d& sigma : sigmas) sigma *= factor;
  PositionScale scale;
  FillUncertainty(found.centres, sigmas, scale);
  report.turn_sigma_rad = scale.turn_sigma_rad;
  report.places_relative_sigma = scale.relative_sigma;
}

// What is reported of the result.
void Complete(const KnownMetres& known, const SfmModel& adjusted, MetricStart& start) {
  MetricReport& report = start.report;
  std::vector<Eigen::Vector3d> before, after;
  for (size_t i = 0; i < adjusted.images.size(); ++i) {
    before.push_back(CentreOf(start.model, static_cast<int>(i)));
    after.push_back(CentreOf(adjusted, static_cast<int>(i)));
  }
  report.metres_per_unit *= SpreadOf(after) / SpreadOf(before);
  double weights = 0;  // of the scale, squared inverse standard deviations
  for (const KnownDistance& d : known.distances) {
    weights += std::pow(d.length_m / SigmaOf(d), 2);
    report.found_m.push_back(DistanceOf(adjusted, d));
    const double off = (report.found_m.back() - d.length_m) / SigmaOf(d);
    report.sigmas_off.push_back(std::abs(off));
    if (report.sigmas_off.back() <= kMaxOff) continue;
    throw Error(
        fmt::format("{}: expected a distance that the photos agree with, found {:.5g} m after "
                    "adjustment, {:.1f} "
                    "standard deviations off; is it the right pair?",
                    d.name, report.found_m.back(), report.sigmas_off.back()));
  }
  if (!known.places.empty()) CompletePlaces(known, adjusted, start);
  if (!known.places.empty() && report.places_tell_scale) {
    weights += std::pow(report.places_relative_sigma, -2);
  }
  report.relative_sigma = 1 / std::sqrt(weights);
  if (!(report.relative_sigma <= kMaxRelativeSigma)) {
    throw Error(
        fmt::format("bundle adjustment: expected positions or distances that determine the scale "
                    "to {:.0f} %, found "
                    "ones that determine it to {:.0f} %: they err too much for cameras that stand "
                    "so near to each "
                    "other",
                    100 * kMaxRelativeSigma, 100 * report.relative_sigma));
  }
}

}  // namespace

MetricStart StartInMetres(const SfmModel& model, const KnownMetres& known,
                          const RefineOptions& options) {
  MetricStart start;
  start.options = options;
  Agreement agreement;
  const Similarity metric_from_model = known.places.empty()
                                           ? FromDistances(model, known)
                                           : FromPlaces(model, known, agreement, start.report);
  start.model = Moved(model, metric_from_model);
  start.report.metres_per_unit = metric_from_model.scale;
  for (const KnownDistance& d : known.distances) {
    start.options.distances.push_back({d.image_a, d.image_b, d.length_m, SigmaOf(d)});
    start.report.given_m.push_back(DistanceOf(start.model, d));
  }
  if (!start.report.places_tell_scale) agreement = TurnToPlaces(known, agreement, start);
  SettlePlaces(known, start, agreement);
  return start;
}

Refined RefineInMetres(const KnownMetres& known, MetricStart& start) {
  Refined refined = Refine(start.model, start.options);
  if (!refined.changed) {
    throw Error(
        fmt::format("bundle adjustment: expected a model that positions and distances can "
                    "constrain, found none: {}; dtr calibrate scale carries a set as a whole",
                    refined.reason));
  }
  Complete(known, refined.model, start);
  return refined;
}

}  // namespace dtr::calib
