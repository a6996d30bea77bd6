#include "calib/validation/photos.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "calib/bundle/lens_params.h"
#include "calib/bundle/moved.h"
#include "calib/bundle/parts.h"
#include "calib/bundle/undetermined.h"
#include "calib/distributions.h"
#include "calib/validation/image_shift.h"
#include "calib/validation/photo_patterns.h"
#include "calib/validation/photo_solves.h"
#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"
#include "dtr/base/random.h"

namespace dtr::calib {
namespace {

constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();
constexpr size_t kMinPoints = 50;
constexpr int kMinImageObservations = 10;  // of an image: its pose has 6 unknowns, these 20 numbers
constexpr double kSquare = 1e-3;           // relative difference of fx and fy
constexpr double kMaxValidationPoints = 4000;
constexpr std::uint64_t kDraw = 0xd4a3;

// With distortion, zero where it starts: what undistortion left behind becomes a parameter. Pixels
// that the stored lens has as square stay so: sensors' are, and more freedom than a camera has
// would make every real one differ.
Bundle WithDistortion(Bundle bundle) {
  for (LensCamera& lens : bundle.lenses) {
    if (lens.model != CameraModel::kPinhole) continue;
    const bool square = std::abs(lens.params[0] / lens.params[1] - 1) < kSquare;
    lens.model = square ? CameraModel::kRadial : CameraModel::kOpenCv;
    if (square) lens.params.erase(lens.params.begin() + 1);
    lens.params.resize(static_cast<size_t>(ParameterCount(lens.model)), 0);
  }
  return bundle;
}

double Length(const Eigen::VectorXd& difference, const Eigen::MatrixXd& covariance) {
  const double squared = difference.dot(covariance.ldlt().solve(difference));
  return squared >= 0 ? std::sqrt(squared) : kNoValue;
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

void CompareWithStored(const Bundle& stored, const Adjusted& fresh,
                       const BundleCovariance& covariance, PhotosValidation& validation) {
  const std::vector<double> moved = MovedPxInNearestWorld(fresh, stored);
  Bundle only_lenses = fresh.bundle;
  only_lenses.lenses = stored.lenses;
  const std::vector<double> moved_by_lens = MovedPx(fresh, only_lenses);
  for (size_t i = 0; i < stored.images.size(); ++i) {
    PhotoValidation camera;
    camera.name = stored.images[i].name;
    camera.moved_px = moved[i];
    const Eigen::MatrixXd variance = covariance.OfImage(static_cast<int>(i));
    camera.sigmas = Length(
        PoseDifference(stored.images[i].cam_from_world, fresh.bundle.images[i].cam_from_world),
        variance);
    const auto largest = [](const Eigen::Matrix3d& m) {
      return RootOfVariance(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(m).eigenvalues()[2]);
    };
    camera.turn_sigma_rad = largest(variance.topLeftCorner<3, 3>());
    camera.centre_sigma = largest(variance.bottomRightCorner<3, 3>());
    validation.cameras.push_back(std::move(camera));
  }
  for (size_t i = 0; i < stored.lenses.size(); ++i) {
    IntrinsicsValidation lens;
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
    validation.lenses.push_back(std::move(lens));
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

std::string LensReason(const IntrinsicsValidation& lens) {
  size_t worst = 0;
  double most = 0;
  for (size_t k = 0; k < lens.names.size(); ++k) {
    const double z = std::abs(lens.fresh[k] - lens.stored[k]) / lens.sigma[k];
    if (z > most) {
      most = z;
      worst = k;
    }
  }
  return fmt::format(
      "{}: stored {:.6g}, the observations say {:.6g} +- {:.2g}; points move by {:.3g} px",
      lens.names[worst], lens.stored[worst], lens.fresh[worst], lens.sigma[worst], lens.moved_px);
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

// Where two halves differ by more than predicted, errors are larger than the observations' scatter
// says (they are not independent, or the lens is another): uncertainties grow by that factor.
void WidenByHalves(PhotosValidation& validation) {
  const double factor =
      std::isfinite(validation.halves_ratio) ? std::max(1.0, validation.halves_ratio) : 1;
  for (IntrinsicsValidation& lens : validation.lenses) {
    lens.sigmas /= factor;
    for (double& sigma : lens.sigma) sigma *= factor;
  }
  for (PhotoValidation& camera : validation.cameras) {
    camera.sigmas /= factor;
    camera.turn_sigma_rad *= factor;
    camera.centre_sigma *= factor;
    camera.image_shift_px *= factor;
    for (PlacedPixel& point : camera.placed) point.sigma_px *= factor;
  }
}

void AddDifferences(const BundleLimits& limits, PhotosValidation& validation) {
  const double negligible_px = NegligiblePx(limits, validation.sigma_px);
  // What could not be computed is the worst, not the best.
  const auto rank = [&](const auto& item) {
    if (item.moved_px <= negligible_px) return 0.0;
    return std::isfinite(item.sigmas) ? item.sigmas : std::numeric_limits<double>::infinity();
  };
  const auto by_rank = [&](const auto& a, const auto& b) { return rank(a) < rank(b); };
  const auto lens = std::max_element(validation.lenses.begin(), validation.lenses.end(), by_rank);
  validation.tests.push_back(Difference("lens_difference_sigmas", lens->sigmas, lens->moved_px,
                                        limits.max_sigmas, negligible_px, LensReason(*lens)));
  const auto camera =
      std::max_element(validation.cameras.begin(), validation.cameras.end(), by_rank);
  validation.tests.push_back(Difference(
      "camera_difference_sigmas", camera->sigmas, camera->moved_px, limits.max_sigmas,
      negligible_px,
      fmt::format("{}: its stored pose against a fresh solve; its points move by {:.3g} px",
                  camera->name, camera->moved_px)));
}

void AddHalves(const BundleLimits& limits, const Halves& halves, const FreshSolves& solves,
               PhotosValidation& validation) {
  const Adjusted* solved = solves.solved + 1;
  validation.halves_ratio = kNoValue;
  if (halves.parts.empty()) {
    validation.tests.push_back(AtMost(
        "halves_ratio", kNoValue, limits.max_halves_ratio,
        fmt::format(
            "expected two photos of {} observations or more, whose halves can be solved apart",
            kMinObservationsOfHalf)));
    return;
  }
  const BundleCovariance covariances[2] = {CovarianceOf(solved[0], solves.options),
                                           CovarianceOf(solved[1], solves.options)};
  if (covariances[0].determined && covariances[1].determined) {
    validation.halves_ratio = HalvesRatio(solved, covariances);
  }
  Check check =
      AtMost("halves_ratio", validation.halves_ratio, limits.max_halves_ratio,
             "two halves of the points, solved apart: their poses' difference over the predicted");
  double moved_px = 0;
  for (const double px : MovedPxInNearestWorld(solved[0], solved[1].bundle)) {
    if (px > moved_px) moved_px = px;
  }
  // Exact observations leave rounding, of which no ratio means anything.
  if (moved_px <= NegligiblePx(limits, validation.sigma_px)) {
    check.passed = true;
    check.reason += fmt::format("; points move by {:.2g} px at most", moved_px);
  }
  if (!halves.left_out.empty()) {
    check.reason += fmt::format("; without photos of fewer than {} observations: {}",
                                kMinObservationsOfHalf, halves.left_out);
  }
  validation.tests.push_back(std::move(check));
}

void AddDegeneracies(PhotosValidation& validation) {
  std::string reason;
  int harmful = 0;
  for (const Degeneracy& d : validation.degeneracies) {
    if (!d.harmful) continue;
    reason += fmt::format("{}{}: {}", reason.empty() ? "" : "; ", d.name, d.detail);
    ++harmful;
  }
  validation.tests.push_back(
      AtMost("degeneracies", harmful, 0, reason.empty() ? "none that matters" : reason));
}

// Principal points that differ from photo to photo by more than cameras do were freed for each of
// them: where the observations leave them open, nothing but that solve says that they are right,
// and focal lengths and poses are as wrong as they are.
void AddUndeterminedTerms(const Bundle& stored, const FreshSolves& solves,
                          const BundleLimits& limits, PhotosValidation& validation) {
  std::map<std::pair<int, int>, std::vector<int>> by_size;
  for (size_t i = 0; i < stored.lenses.size(); ++i) {
    const LensCamera& lens = stored.lenses[i];
    by_size[{lens.width_px, lens.height_px}].push_back(static_cast<int>(i));
  }
  std::vector<std::string> names;
  double farthest_px = 0;
  for (const int lens : solves.open_centres) {
    const LensCamera& own = stored.lenses[static_cast<size_t>(lens)];
    const auto& alike = by_size.at({own.width_px, own.height_px});
    const auto at = static_cast<size_t>(FocalCount(own.model));
    const double usual_px = kKnownPrincipalPointShare * std::max(own.width_px, own.height_px);
    Eigen::Vector2d off_px;
    for (const size_t axis : {0, 1}) {
      std::vector<double> centres;
      for (const int other : alike) {
        centres.push_back(stored.lenses[static_cast<size_t>(other)].params[at + axis]);
      }
      off_px[static_cast<long>(axis)] = own.params[at + axis] - UpperMedian(centres);
    }
    if (off_px.norm() <= usual_px) continue;
    names.push_back(NameOfLens(stored, lens));
    farthest_px = std::max(farthest_px, off_px.norm());
  }
  if (limits.lenses_are_given) names.clear();
  constexpr size_t kNamed = 5;
  const size_t named = std::min(kNamed, names.size());
  validation.tests.push_back(
      AtMost("undetermined_terms", static_cast<double>(names.size()), 0,
             names.empty()
                 ? "no term of a camera was freed that the observations leave open"
                 : fmt::format(
                       "principal points of {}{}: freed photo by photo, up to {:.3g} px apart from "
                       "the usual one, and the observations leave them open",
                       fmt::join(names.begin(), names.begin() + static_cast<long>(named), ", "),
                       names.size() > named ? fmt::format(" and {} more", names.size() - named)
                                            : std::string(),
                       farthest_px)));
}

void AddImage(const BundleLimits& limits, PhotosValidation& validation) {
  const PhotoValidation* worst = nullptr;
  for (const PhotoValidation& camera : validation.cameras) {
    if (std::isfinite(camera.image_shift_px) &&
        (worst == nullptr || camera.image_shift_px > worst->image_shift_px)) {
      worst = &camera;
    }
  }
  validation.tests.push_back(AtMost(
      "image_shift_px", worst != nullptr ? worst->image_shift_px : kNoValue,
      limits.max_image_shift_px,
      worst != nullptr
          ? fmt::format("{}: 95 % of its points, placed by two neighbours, are uncertain by less",
                        worst->name)
          : "no view's points are placed by two others"));
}

PhotosValidation NotValidated(PhotosValidation validation, const std::string& why) {
  validation.not_validated = why;
  return validation;
}

// Points to validate by, a share of all by their hash; and all points of images of which the draw
// could leave too few for halves.
Bundle Drawn(const Bundle& given, double share) {
  if (share >= 1) return given;
  std::vector<int> observations(given.images.size());
  for (const BundleObservation& o : given.observations)
    ++observations[static_cast<size_t>(o.image)];
  std::vector<bool> kept(given.points.size());
  for (size_t p = 0; p < kept.size(); ++p) kept[p] = UniformFromHash(HashOf(p, kDraw)) < share;
  for (const BundleObservation& o : given.observations) {
    const bool few =
        share * observations[static_cast<size_t>(o.image)] < 2 * kMinObservationsOfHalf;
    if (few) kept[static_cast<size_t>(o.point)] = true;
  }
  return WithPoints(given, [&](std::uint64_t p) { return kept[static_cast<size_t>(p)]; });
}

// The last test: images of which no part's fresh solve could say anything fail it.
void AddNotValidated(const Bundle& given, PhotosValidation& all) {
  std::vector<std::string> lost;
  for (const BundleImage& image : given.images) {
    const bool judged =
        std::any_of(all.cameras.begin(), all.cameras.end(),
                    [&](const PhotoValidation& camera) { return camera.name == image.name; });
    if (!judged) lost.push_back(image.name);
  }
  if (lost.empty()) {
    all.not_validated.clear();  // what one part could not validate another has
  } else if (all.not_validated.empty()) {
    all.not_validated = fmt::format("fewer than {} observations of what photos beside them see: {}",
                                    kMinImageObservations, fmt::join(lost, ", "));
  }
  all.tests.push_back({"photos_not_validated", static_cast<double>(lost.size()), 0, lost.empty(),
                       lost.empty() ? "a fresh bundle adjustment has all"
                                    : "no fresh bundle adjustment says whether they are right: " +
                                          all.not_validated});
}

PhotosValidation ValidatePart(const Bundle& given, const BundleLimits& limits,
                              const Progress* progress) {
  PhotosValidation validation;
  std::vector<bool> seen(given.points.size());
  for (const BundleObservation& o : given.observations) seen[static_cast<size_t>(o.point)] = true;
  const auto points = static_cast<size_t>(std::count(seen.begin(), seen.end(), true));
  const Bundle stored = WithDistortion(WithoutWeakImages(
      Drawn(given, kMaxValidationPoints / static_cast<double>(points)), kMinImageObservations));
  if (points < kMinPoints) {
    return NotValidated(
        validation,
        fmt::format("expected {} points or more that two views see, found {}", kMinPoints, points));
  }
  if (stored.images.size() < 2) {
    return NotValidated(validation,
                        fmt::format("expected two photos or more of {} observations each, found {}",
                                    kMinImageObservations, stored.images.size()));
  }
  const Halves halves = HalvesOf(stored);
  FreshSolves solves;
  try {
    solves = SolveAfresh(stored, halves, progress);
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& error) {
    return NotValidated(validation, error.what());
  }
  const Adjusted& fresh = solves.solved[0];
  const BundleCovariance& covariance = solves.covariance;
  validation.observations = fresh.observations;
  validation.sigma_px = fresh.sigma_px;
  validation.condition = covariance.condition;
  validation.degeneracies = FindDegeneracies(fresh, covariance, limits.max_focal_share);
  validation.degeneracies.insert(validation.degeneracies.end(), solves.open.begin(),
                                 solves.open.end());
  AddDegeneracies(validation);
  AddUndeterminedTerms(stored, solves, limits, validation);
  if (!covariance.computed) {
    return NotValidated(
        validation,
        fmt::format("more than {} unknowns: too many for their covariance", kMaxUnknowns));
  }
  if (!covariance.determined) {
    return NotValidated(validation, "the observations do not determine " + covariance.weakest);
  }
  if (!fresh.converged) {
    return NotValidated(
        validation, fmt::format("the fresh solve did not settle in {} steps", fresh.iterations));
  }
  CompareWithStored(stored, fresh, covariance, validation);
  ImageShifts(fresh, covariance, validation.cameras);
  AddHalves(limits, halves, solves, validation);
  WidenByHalves(validation);
  AddDifferences(limits, validation);
  AddImage(limits, validation);
  for (Check& check : PatternChecks(fresh, covariance, limits)) {
    validation.tests.push_back(std::move(check));
  }
  return validation;
}

// The worse of two checks of one name: what failed, and then by how much; what could not be worked
// out is worse than any number.
bool IsWorse(const Check& a, const Check& b) {
  if (a.passed != b.passed) return !a.passed;
  const auto rank = [](const Check& check) {
    return std::isnan(check.value) ? std::numeric_limits<double>::infinity() : check.value;
  };
  return rank(a) > rank(b);
}

void JoinTests(const PhotosValidation& part, PhotosValidation& all) {
  for (const Check& test : part.tests) {
    const auto same = std::find_if(all.tests.begin(), all.tests.end(),
                                   [&](const Check& other) { return other.name == test.name; });
    if (same == all.tests.end()) {
      all.tests.push_back(test);
    } else if (IsWorse(test, *same)) {
      *same = test;
    }
  }
}

// One validation result of many: the worst of each test, every camera once.
void Join(const PhotosValidation& part, PhotosValidation& all) {
  JoinTests(part, all);
  for (const PhotoValidation& camera : part.cameras) {
    const bool known =
        std::any_of(all.cameras.begin(), all.cameras.end(),
                    [&](const PhotoValidation& other) { return other.name == camera.name; });
    if (!known) all.cameras.push_back(camera);
  }
  all.lenses.insert(all.lenses.end(), part.lenses.begin(), part.lenses.end());
  all.degeneracies.insert(all.degeneracies.end(), part.degeneracies.begin(),
                          part.degeneracies.end());
  if (all.not_validated.empty()) all.not_validated = part.not_validated;
  all.sigma_px = std::max(all.sigma_px, part.sigma_px);
  all.condition = std::max(all.condition, part.condition);
  if (std::isnan(part.halves_ratio) || part.halves_ratio > all.halves_ratio) {
    all.halves_ratio = part.halves_ratio;  // and NaN, once there, stays
  }
  all.observations += part.observations;
}

}  // namespace

double NegligiblePx(const BundleLimits& limits, double sigma_px) {
  return std::clamp(limits.negligible_sigmas * sigma_px, limits.min_negligible_px,
                    limits.max_negligible_px);
}

PhotosValidation ValidatePhotos(const Bundle& given, const BundleLimits& limits,
                                const Progress* progress) {
  // With distortion, as it is solved for.
  // Photos of fewer observations are those of the test cameras_untested.
  const Bundle seen = WithoutWeakImages(given, kMinImageObservations);
  if (seen.images.empty()) {
    PhotosValidation none = NotValidated({}, "no photo has points to validate by");
    AddNotValidated(given, none);
    return none;
  }
  PhotosValidation all;
  if (ValidationUnknowns(WithDistortion(seen)) <= limits.max_unknowns) {
    all = ValidatePart(seen, limits, progress);
  } else {
    // Half of what one part may have: work grows with the cube.
    const std::vector<Bundle> parts = PartsOf(seen, limits.max_unknowns / 2);
    for (const Bundle& part : parts) Join(ValidatePart(part, limits, progress), all);
    all.parts = static_cast<int>(parts.size());
  }
  AddNotValidated(seen, all);
  return all;
}

}  // namespace dtr::calib
