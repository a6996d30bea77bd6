#include "calib/bundle/judge.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "calib/bundle/lens_params.h"
#include "calib/bundle/shutter.h"
#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/random.h"

namespace dtr::calib {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
constexpr size_t kFewestPoints = 50;
constexpr int kFewestSights = 10;        // of an image: its pose has 6 unknowns, these 20 numbers
constexpr int kFewestSightsOfHalf = 30;  // of an image, of all points: half of them must do
constexpr double kSquare = 1e-3;         // relative difference of fx and fy
constexpr double kMostPoints = 4000;
constexpr int kPointsPerView = 40;  // that its picture's shift is worked out at
constexpr std::uint64_t kDraw = 0xd4a3, kHalf = 0x4a1f;

// With distortion, zero where it starts: what undistortion left behind becomes a parameter. Pixels
// that the stored lens has as square stay so: sensors' are, and more freedom than a camera has
// would make every real one differ.
Bundle WithDistortion(Bundle bundle) {
  for (LensCamera& lens : bundle.lenses) {
    if (lens.model != LensModel::kPinhole) continue;
    const bool square = std::abs(lens.params[0] / lens.params[1] - 1) < kSquare;
    lens.model = square ? LensModel::kRadial : LensModel::kOpenCv;
    if (square) lens.params.erase(lens.params.begin() + 1);
    lens.params.resize(static_cast<size_t>(ParameterCount(lens.model)), 0);
  }
  return bundle;
}

template <typename Keep>
Bundle WithPoints(const Bundle& bundle, const Keep& keep) {
  Bundle some = bundle;
  std::erase_if(some.observations, [&](const BundleObservation& o) {
    return !keep(static_cast<std::uint64_t>(o.point));
  });
  return some;
}

// Without the images that fewer than kFewestSights sights judge, and without lenses nobody uses.
Bundle WithoutUnseen(const Bundle& bundle) {
  std::vector<int> sights(bundle.images.size());
  for (const BundleObservation& o : bundle.observations) ++sights[static_cast<size_t>(o.image)];
  Bundle seen;
  seen.points = bundle.points;
  std::vector<int> image_at(bundle.images.size(), -1), lens_at(bundle.lenses.size(), -1);
  for (size_t i = 0; i < bundle.images.size(); ++i) {
    if (sights[i] < kFewestSights) continue;
    image_at[i] = static_cast<int>(seen.images.size());
    seen.images.push_back(bundle.images[i]);
    int& lens = lens_at[static_cast<size_t>(bundle.images[i].lens)];
    if (lens < 0) {
      lens = static_cast<int>(seen.lenses.size());
      seen.lenses.push_back(bundle.lenses[static_cast<size_t>(bundle.images[i].lens)]);
    }
    seen.images.back().lens = lens;
  }
  for (BundleObservation o : bundle.observations) {
    o.image = image_at[static_cast<size_t>(o.image)];
    if (o.image >= 0) seen.observations.push_back(o);
  }
  return seen;
}

AdjustOptions AllFree() {
  AdjustOptions options;
  options.lens = LensFreedom::kAll;
  return options;
}

double Length(const Eigen::VectorXd& difference, const Eigen::MatrixXd& covariance) {
  const double squared = difference.dot(covariance.ldlt().solve(difference));
  return squared >= 0 ? std::sqrt(squared) : kNothing;
}

// (turn, shift of the centre) that takes `from` to `to`.
Eigen::VectorXd PoseDifference(const Pose& from, const Pose& to) {
  Eigen::VectorXd d(6);
  const Eigen::AngleAxisd turn((to.rotation * from.rotation.conjugate()).normalized());
  d << turn.angle() * turn.axis(), to.TargetOriginInSource() - from.TargetOriginInSource();
  return d;
}

Eigen::VectorXd ParamDifference(const LensCamera& from, const LensCamera& to) {
  const long n = static_cast<long>(from.params.size());
  return Eigen::Map<const Eigen::VectorXd>(to.params.data(), n) -
         Eigen::Map<const Eigen::VectorXd>(from.params.data(), n);
}

// RMS over the fresh points that an image's used sights show of how far another camera draws them;
// per image. Points that outliers made say nothing of cameras.
std::vector<double> Moved(const Adjusted& solved, const Bundle& other_cameras) {
  const Bundle& fresh = solved.bundle;
  Bundle other = fresh;
  other.lenses = other_cameras.lenses;
  other.images = other_cameras.images;
  const auto a = Residuals(fresh), b = Residuals(other);
  std::vector<double> squared(fresh.images.size()), count(fresh.images.size());
  for (size_t i = 0; i < a.size(); ++i) {
    if (!solved.used[i] || !a[i].allFinite() || !b[i].allFinite()) continue;
    const auto image = static_cast<size_t>(fresh.observations[i].image);
    squared[image] += (a[i] - b[i]).squaredNorm();
    count[image] += 1;
  }
  for (size_t i = 0; i < squared.size(); ++i) {
    squared[i] = count[i] > 0 ? std::sqrt(squared[i] / count[i]) : kNothing;
  }
  return squared;
}

Check AtMost(std::string name, double value, double limit, std::string reason) {
  return {std::move(name), value, limit, value <= limit, std::move(reason)};
}

// Sights of each image, by index, of points that are places.
std::vector<std::vector<int>> SightsByImage(const Adjusted& fresh) {
  std::vector<std::vector<int>> sights(fresh.bundle.images.size());
  for (size_t i = 0; i < fresh.bundle.observations.size(); ++i) {
    const BundleObservation& o = fresh.bundle.observations[i];
    if (fresh.used[i] && fresh.bundle.points[static_cast<size_t>(o.point)][3] > 0) {
      sights[static_cast<size_t>(o.image)].push_back(static_cast<int>(i));
    }
  }
  return sights;
}

// An image's points, and the standard deviation (px per axis) of where the two images that share
// most points with it place them.
std::vector<PlacedPixel> Placed(const Adjusted& fresh, const BundleCovariance& covariance,
                                const std::vector<std::vector<int>>& sights,
                                const std::vector<std::vector<int>>& seen_by, int image) {
  const auto& own = sights[static_cast<size_t>(image)];
  std::map<int, int> shared;
  for (const int i : own) {
    const auto point = static_cast<size_t>(fresh.bundle.observations[static_cast<size_t>(i)].point);
    for (const int other : seen_by[point]) shared[other] += other != image;
  }
  std::vector<std::pair<int, int>> ranked;  // -shared points, image
  for (const auto& [other, times] : shared) {
    if (other != image && times > 0) ranked.emplace_back(-times, other);
  }
  if (ranked.size() < 2) return {};
  std::sort(ranked.begin(), ranked.end());
  const int a = ranked[0].second, b = ranked[1].second;
  const auto step = std::max<size_t>(1, own.size() / kPointsPerView);
  std::vector<PlacedPixel> placed;
  for (size_t k = 0; k < own.size(); k += step) {
    const auto& o = fresh.bundle.observations[static_cast<size_t>(own[k])];
    const Eigen::Vector4d& h = fresh.bundle.points[static_cast<size_t>(o.point)];
    const Eigen::Matrix2d variance =
        TransferCovariance(fresh.bundle, covariance, h.head<3>() / h[3], a, b, image);
    if (!variance.allFinite()) continue;
    placed.push_back({o.pixel, std::sqrt(std::max(0.0, variance.trace() / 2))});
  }
  return placed;
}

// 95 % of their standard deviations.
double PictureShift(const std::vector<PlacedPixel>& placed) {
  if (placed.empty()) return kNothing;
  std::vector<double> shifts;
  for (const PlacedPixel& point : placed) shifts.push_back(point.sigma_px);
  std::sort(shifts.begin(), shifts.end());
  return shifts[static_cast<size_t>(0.95 * static_cast<double>(shifts.size() - 1))];
}

void PictureShifts(const Adjusted& fresh, const BundleCovariance& covariance, int threads,
                   Judgement& judgement) {
  const auto sights = SightsByImage(fresh);
  std::vector<std::vector<int>> seen_by(fresh.bundle.points.size());
  for (size_t i = 0; i < sights.size(); ++i) {
    for (const int s : sights[i]) {
      const auto point =
          static_cast<size_t>(fresh.bundle.observations[static_cast<size_t>(s)].point);
      seen_by[point].push_back(static_cast<int>(i));
    }
  }
  ParallelFor(0, static_cast<int>(sights.size()), threads, [&](int i) {
    CameraJudgement& camera = judgement.cameras[static_cast<size_t>(i)];
    camera.placed = Placed(fresh, covariance, sights, seen_by, i);
    camera.picture_shift_px = PictureShift(camera.placed);
  });
}

void CompareWithStored(const Bundle& stored, const Adjusted& fresh,
                       const BundleCovariance& covariance, Judgement& judgement) {
  const std::vector<double> moved = Moved(fresh, stored);
  Bundle only_lenses = fresh.bundle;
  only_lenses.lenses = stored.lenses;
  const std::vector<double> moved_by_lens = Moved(fresh, only_lenses);
  for (size_t i = 0; i < stored.images.size(); ++i) {
    CameraJudgement camera;
    camera.name = stored.images[i].name;
    camera.moved_px = moved[i];
    const Eigen::MatrixXd variance = covariance.OfImage(static_cast<int>(i));
    camera.sigmas = Length(
        PoseDifference(stored.images[i].cam_from_world, fresh.bundle.images[i].cam_from_world),
        variance);
    const auto largest = [](const Eigen::Matrix3d& m) {
      return std::sqrt(
          std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(m).eigenvalues()[2]));
    };
    camera.turn_sigma_rad = largest(variance.topLeftCorner<3, 3>());
    camera.centre_sigma = largest(variance.bottomRightCorner<3, 3>());
    judgement.cameras.push_back(std::move(camera));
  }
  for (size_t i = 0; i < stored.lenses.size(); ++i) {
    LensJudgement lens;
    lens.names = ParameterNames(stored.lenses[i].model);
    lens.stored = stored.lenses[i].params;
    lens.fresh = fresh.bundle.lenses[i].params;
    const Eigen::MatrixXd variance = covariance.OfLens(fresh.bundle, static_cast<int>(i));
    for (long k = 0; k < variance.rows(); ++k) lens.sigma.push_back(std::sqrt(variance(k, k)));
    lens.sigmas = Length(ParamDifference(stored.lenses[i], fresh.bundle.lenses[i]), variance);
    for (size_t image = 0; image < stored.images.size(); ++image) {
      if (stored.images[image].lens == static_cast<int>(i) &&
          moved_by_lens[image] > lens.moved_px) {
        lens.moved_px = moved_by_lens[image];
      }
    }
    judgement.lenses.push_back(std::move(lens));
  }
}

// RMS over cameras of the difference of two independent solves over its predicted length; 1 where
// errors are what was predicted.
double HalvesRatio(const Adjusted halves[2], const BundleCovariance covariances[2]) {
  double sum = 0;
  const auto& images = halves[0].bundle.images;
  for (size_t i = 0; i < images.size(); ++i) {
    const int at = static_cast<int>(i);
    sum += std::pow(Length(PoseDifference(images[i].cam_from_world,
                                          halves[1].bundle.images[i].cam_from_world),
                           covariances[0].OfImage(at) + covariances[1].OfImage(at)),
                    2) /
           6;
  }
  return std::sqrt(sum / static_cast<double>(images.size()));
}

int LeastSights(const Bundle& bundle) {
  std::vector<int> sights(bundle.images.size());
  for (const BundleObservation& o : bundle.observations) ++sights[static_cast<size_t>(o.image)];
  return *std::min_element(sights.begin(), sights.end());
}

void AddHalves(const BundleLimits& limits, const Adjusted halves[2], Judgement& judgement) {
  const BundleCovariance covariances[2] = {CovarianceOf(halves[0], AllFree()),
                                           CovarianceOf(halves[1], AllFree())};
  judgement.halves_ratio = covariances[0].determined && covariances[1].determined
                               ? HalvesRatio(halves, covariances)
                               : kNothing;
  Check check =
      AtMost("halves_ratio", judgement.halves_ratio, limits.max_halves_ratio,
             "two halves of the points, solved apart: their poses' difference over the predicted");
  double moved_px = 0;
  for (const double px : Moved(halves[0], halves[1].bundle)) {
    if (px > moved_px) moved_px = px;
  }
  // Exact sights leave rounding, of which no ratio means anything.
  if (moved_px <= NegligiblePx(limits, judgement.sigma_px)) {
    check.passed = true;
    check.reason += fmt::format("; points move by {:.2g} px at most", moved_px);
  }
  judgement.tests.push_back(std::move(check));
}

std::string LensReason(const LensJudgement& lens) {
  size_t worst = 0;
  double most = 0;
  for (size_t k = 0; k < lens.names.size(); ++k) {
    const double z = std::abs(lens.fresh[k] - lens.stored[k]) / lens.sigma[k];
    if (z > most) {
      most = z;
      worst = k;
    }
  }
  return fmt::format("{}: stored {:.6g}, the sights say {:.6g} +- {:.2g}; points move by {:.3g} px",
                     lens.names[worst], lens.stored[worst], lens.fresh[worst], lens.sigma[worst],
                     lens.moved_px);
}

// A difference fails where it is beyond chance and can be seen.
Check Difference(const char* name, double sigmas, double moved_px, double max_sigmas,
                 double negligible_px, const std::string& reason) {
  Check check = AtMost(name, sigmas, max_sigmas, reason);
  if (!check.passed && moved_px <= negligible_px) {
    check.passed = true;
    check.reason += fmt::format(", which is too little to matter ({:.2g} px)", negligible_px);
  }
  return check;
}

// Where two halves differ by more than predicted, errors are larger than the sights' scatter says
// (they are not independent, or the lens is another): uncertainties grow by that factor.
void WidenByHalves(Judgement& judgement) {
  const double factor =
      std::isfinite(judgement.halves_ratio) ? std::max(1.0, judgement.halves_ratio) : 1;
  for (LensJudgement& lens : judgement.lenses) {
    lens.sigmas /= factor;
    for (double& sigma : lens.sigma) sigma *= factor;
  }
  for (CameraJudgement& camera : judgement.cameras) {
    camera.sigmas /= factor;
    camera.turn_sigma_rad *= factor;
    camera.centre_sigma *= factor;
    camera.picture_shift_px *= factor;
    for (PlacedPixel& point : camera.placed) point.sigma_px *= factor;
  }
}

void AddDifferences(const BundleLimits& limits, Judgement& judgement) {
  const double negligible_px = NegligiblePx(limits, judgement.sigma_px);
  // What could not be computed is the worst, not the best.
  const auto rank = [&](const auto& item) {
    if (item.moved_px <= negligible_px) return 0.0;
    return std::isfinite(item.sigmas) ? item.sigmas : std::numeric_limits<double>::infinity();
  };
  const auto by_rank = [&](const auto& a, const auto& b) { return rank(a) < rank(b); };
  const auto lens = std::max_element(judgement.lenses.begin(), judgement.lenses.end(), by_rank);
  judgement.tests.push_back(Difference("lens_difference_sigmas", lens->sigmas, lens->moved_px,
                                       limits.max_sigmas, negligible_px, LensReason(*lens)));
  const auto camera = std::max_element(judgement.cameras.begin(), judgement.cameras.end(), by_rank);
  judgement.tests.push_back(Difference(
      "camera_difference_sigmas", camera->sigmas, camera->moved_px, limits.max_sigmas,
      negligible_px,
      fmt::format("{}: its stored pose against a fresh solve; its points move by {:.3g} px",
                  camera->name, camera->moved_px)));
}

void AddDegeneracies(Judgement& judgement) {
  std::string reason;
  int harmful = 0;
  for (const Degeneracy& d : judgement.degeneracies) {
    if (!d.harmful) continue;
    reason += fmt::format("{}{}: {}", reason.empty() ? "" : "; ", d.name, d.detail);
    ++harmful;
  }
  judgement.tests.push_back(
      AtMost("degeneracies", harmful, 0, reason.empty() ? "none that matters" : reason));
}

void AddPicture(const BundleLimits& limits, Judgement& judgement) {
  const CameraJudgement* worst = nullptr;
  for (const CameraJudgement& camera : judgement.cameras) {
    if (std::isfinite(camera.picture_shift_px) &&
        (worst == nullptr || camera.picture_shift_px > worst->picture_shift_px)) {
      worst = &camera;
    }
  }
  judgement.tests.push_back(AtMost(
      "picture_shift_px", worst != nullptr ? worst->picture_shift_px : kNothing,
      limits.max_picture_shift_px,
      worst != nullptr
          ? fmt::format("{}: 95 % of its points, placed by two neighbours, are uncertain by less",
                        worst->name)
          : "no view's points are placed by two others"));
}

void AddShutter(const BundleLimits& limits, const Adjusted& fresh,
                const BundleCovariance& covariance, Judgement& judgement) {
  const ShutterTest test = TestShutter(fresh, covariance);
  if (!test.not_tested.empty()) {
    judgement.tests.push_back(
        AtMost("rolling_shutter_px", 0, limits.max_shutter_px, "not tested: " + test.not_tested));
    return;
  }
  const bool chance = test.p >= limits.min_p;
  Check check = AtMost(
      "rolling_shutter_px", chance ? 0 : test.amplitude_px, limits.max_shutter_px,
      fmt::format("residuals as of cameras that turn while the rows are read: {:.3f} px RMS per "
                  "coordinate; p = {:.2g}{}",
                  test.amplitude_px, test.p, chance ? ", what noise does" : ""));
  if (!check.passed) {
    const auto surest = static_cast<size_t>(
        std::max_element(test.sigmas.begin(), test.sigmas.end()) - test.sigmas.begin());
    check.reason += fmt::format(
        "; the surest is {}, by {:.3g} degrees from its first row to its "
        "last",
        fresh.bundle.images[surest].name, test.turns_rad[surest] * 180 / EIGEN_PI);
  }
  judgement.tests.push_back(std::move(check));
}

}  // namespace

double NegligiblePx(const BundleLimits& limits, double sigma_px) {
  return std::clamp(limits.negligible_sigmas * sigma_px, limits.least_negligible_px,
                    limits.most_negligible_px);
}

Judgement Judge(const Bundle& given, const BundleLimits& limits, int threads) {
  Judgement judgement;
  const double share = kMostPoints / static_cast<double>(given.points.size());
  const Bundle stored = WithDistortion(WithoutUnseen(WithPoints(given, [&](std::uint64_t p) {
    return share >= 1 || UniformFromHash(HashOf(p, kDraw)) < share;
  })));
  if (given.points.size() < kFewestPoints || stored.images.size() < 2) {
    judgement.not_judged = fmt::format("expected {} points or more that two views see, found {}",
                                       kFewestPoints, given.points.size());
    return judgement;
  }
  const bool halves = LeastSights(stored) >= kFewestSightsOfHalf;
  Adjusted solved[3];  // all points, two halves
  try {
    ParallelFor(0, halves ? 3 : 1, threads, [&](int i) {
      const Bundle part = WithPoints(stored, [&](std::uint64_t p) {
        return i == 0 || (HashOf(p, kHalf) & 1) == static_cast<std::uint64_t>(i - 1);
      });
      solved[i] = Adjust(part, AllFree());
    });
  } catch (const Error& error) {
    judgement.not_judged = error.what();
    return judgement;
  }
  const Adjusted& fresh = solved[0];
  const BundleCovariance covariance = CovarianceOf(fresh, AllFree());
  judgement.sights = fresh.sights;
  judgement.sigma_px = fresh.sigma_px;
  judgement.condition = covariance.condition;
  judgement.degeneracies = FindDegeneracies(fresh, covariance, limits.max_focal_share);
  AddDegeneracies(judgement);
  if (!covariance.computed) {
    judgement.not_judged =
        fmt::format("more than {} unknowns: too many for their covariance", kMostUnknowns);
    return judgement;
  }
  if (!covariance.determined) return judgement;
  if (!fresh.converged) {
    judgement.not_judged =
        fmt::format("the fresh solve did not settle in {} steps", fresh.iterations);
    return judgement;
  }
  CompareWithStored(stored, fresh, covariance, judgement);
  PictureShifts(fresh, covariance, threads, judgement);
  if (halves) AddHalves(limits, solved + 1, judgement);
  WidenByHalves(judgement);
  AddDifferences(limits, judgement);
  AddPicture(limits, judgement);
  AddShutter(limits, fresh, covariance, judgement);
  return judgement;
}

std::string ToJson(const Judgement& judgement) {
  using Json = nlohmann::ordered_json;
  const auto number = [](double v) { return std::isfinite(v) ? Json(v) : Json(nullptr); };
  Json json;
  if (!judgement.not_judged.empty()) json["not_judged"] = judgement.not_judged;
  json["sights"] = judgement.sights;
  json["sigma_px"] = number(judgement.sigma_px);
  json["condition"] = number(judgement.condition);
  json["halves_ratio"] = number(judgement.halves_ratio);
  json["lenses"] = Json::array();
  for (const LensJudgement& lens : judgement.lenses) {
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
  for (const CameraJudgement& camera : judgement.cameras) {
    json["cameras"].push_back({{"name", camera.name},
                               {"difference_sigmas", number(camera.sigmas)},
                               {"moved_px", number(camera.moved_px)},
                               {"turn_sigma_rad", number(camera.turn_sigma_rad)},
                               {"centre_sigma", number(camera.centre_sigma)},
                               {"picture_shift_px", number(camera.picture_shift_px)}});
  }
  json["degeneracies"] = Json::array();
  for (const Degeneracy& d : judgement.degeneracies) {
    json["degeneracies"].push_back(
        {{"name", d.name}, {"detail", d.detail}, {"harmful", d.harmful}});
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace dtr::calib
