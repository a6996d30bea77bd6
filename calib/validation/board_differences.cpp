#include "calib/validation/board_differences.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "calib/distributions.h"

namespace dtr::calib {
namespace {

class DifferenceTests {
 public:
  DifferenceTests(const ValidatedCalibration& calibration, const Fresh& kept, const Fresh* unseen,
                  const BoardLimits& limits, std::vector<ValidatedCamera>& cameras)
      : calibration_(calibration),
        kept_(kept),
        unseen_(unseen),
        limits_(limits),
        cameras_(cameras) {}

  std::vector<Check> Run() {
    const double self = limits_.max_self_difference_sigmas;
    std::vector<Reference> references;
    if (!calibration_.kept.empty()) references.push_back({kept_, false});
    if (unseen_ != nullptr) references.push_back({*unseen_, true});
    const bool rig = calibration_.cameras.size() > 1;
    Check lens{"lens_difference_sigmas", -1, self, true, ""};
    Check place{"place_difference_sigmas", -1, self, true, ""};
    Check scale{"rig_scale_sigmas", -1, self, true, ""};
    for (const Reference& reference : references) {
      if (reference.fresh.solution) {
        TestAgainst(reference, lens, place, scale);
        continue;
      }
      lens = NotTested("lens_difference_sigmas", self, reference.fresh.refused);
      place = NotTested("place_difference_sigmas", self, reference.fresh.refused);
      break;
    }
    std::vector<Check> checks;
    if (calibration_.free_lenses) checks.push_back(lens);
    if (!rig) return checks;
    checks.push_back(place);
    if (scale.value >= 0) checks.push_back(scale);
    return checks;
  }

 private:
  // The stored calibration is compared with a solve of the views that made it, which must be
  // the same numbers, and one of unseen views, which errs by itself. The worse of both is reported.
  struct Reference {
    const Fresh& fresh;
    bool test_views = false;
    double Limit(double min_p, double self, int count) const {
      return test_views ? std::sqrt(ChiSquaredLimit(min_p, count)) : self;
    }
  };

  void TestAgainst(const Reference& reference, Check& lens, Check& place, Check& scale) {
    const RigSolution& solution = *reference.fresh.solution;
    const Eigen::VectorXd difference =
        Difference(solution.layout, calibration_.cameras, solution.rig.cameras);
    Eigen::MatrixXd covariance = solution.covariance;
    // Unseen views: both calibrations err.
    if (reference.test_views && kept_.solution) covariance += kept_.solution->covariance;
    const ProjectionSensitivity sensitivity(solution);
    for (size_t c = 0; c < calibration_.cameras.size(); ++c) {
      ValidatedCamera& camera = cameras_[c];
      camera.difference = ShiftMap(solution, sensitivity, difference, c,
                                   BoardDistance(calibration_.board, solution.rig, c));
      if (solution.layout.LensAt(c) >= 0) {
        Hold(reference, solution.layout, difference, covariance, solution.layout.LensAt(c),
             FreeParameterCount(calibration_.cameras[c].model), c, lens);
      }
      if (solution.layout.PlaceAt(c) >= 0) {
        Hold(reference, solution.layout, difference, covariance, solution.layout.PlaceAt(c), 6, c,
             place);
      }
    }
    if (calibration_.cameras.size() > 1) {
      TestScale(reference, solution, covariance, difference, scale);
    }
  }

  static const char* NameOfSolve(const Reference& reference) {
    return reference.test_views ? "the held-out views'" : "fresh";
  }

  // Keeps in `check` the part that is farthest beyond its limit.
  void Hold(const Reference& reference, const RigLayout& layout, const Eigen::VectorXd& difference,
            const Eigen::MatrixXd& covariance, int at, int count, size_t camera, Check& check) {
    double distance = Distance(difference, covariance, at, count);
    const double limit = reference.Limit(limits_.min_p, limits_.max_self_difference_sigmas, count);
    std::string reason = fmt::format("{}: stored less {} solve; {}; up to {:.3g} px in the image",
                                     calibration_.cameras[camera].name, NameOfSolve(reference),
                                     LargestPart(layout, difference, covariance, at, count),
                                     cameras_[camera].difference.Largest());
    // What was calibrated elsewhere does not say how uncertain it is: pixels must do.
    const double shown_px = cameras_[camera].difference.Quantile(kMaxOfImage);
    if (calibration_.kept.empty() && distance > limit && shown_px <= limits_.max_uncertainty_px) {
      reason += fmt::format(
          "; {:.3g} sigma of that solve alone, for the file does not say what it is uncertain by, "
          "but at most {:.3g} px in 95 % of the image, where {:.3g} px are allowed",
          distance, shown_px, limits_.max_uncertainty_px);
      distance = 0;
    }
    if (check.value >= 0 && !(distance / limit > check.value / check.limit)) return;
    check = {check.name, distance, limit, distance <= limit, std::move(reason)};
  }

  // One factor on all shifts: another size of the board.
  void TestScale(const Reference& reference, const RigSolution& solution,
                 const Eigen::MatrixXd& covariance, const Eigen::VectorXd& difference,
                 Check& check) {
    Eigen::VectorXd direction = Eigen::VectorXd::Zero(difference.size());
    for (size_t c = 1; c < solution.rig.cameras.size(); ++c) {
      direction.segment<3>(solution.layout.PlaceAt(c) + 3) =
          solution.rig.cameras[c].cam_from_rig.translation;
    }
    const double squares = direction.squaredNorm();
    if (!(squares > 0)) return;  // cameras in one point: no length to compare
    const double scale = direction.dot(difference) / squares;
    const double sigma = std::sqrt(direction.dot(covariance * direction)) / squares;
    const double value =
        sigma > 0 ? std::abs(scale) / sigma : std::numeric_limits<double>::infinity();
    const double limit = reference.Limit(limits_.min_p, limits_.max_self_difference_sigmas, 1);
    if (check.value >= 0 && !(value / limit > check.value / check.limit)) return;
    check = AtMost(
        "rig_scale_sigmas", value, limit,
        fmt::format("stored distances between cameras are {:+.4f} % (+- {:.4f} %) off "
                    "what squares of {} say, by {} solve",
                    100 * scale, 100 * sigma, calibration_.board.square, NameOfSolve(reference)));
  }

  const ValidatedCalibration& calibration_;
  const Fresh& kept_;
  const Fresh* unseen_;
  const BoardLimits& limits_;
  std::vector<ValidatedCamera>& cameras_;
};

}  // namespace

std::vector<Check> TestDifferences(const ValidatedCalibration& calibration, const Fresh& kept,
                                   const Fresh* unseen, const BoardLimits& limits,
                                   std::vector<ValidatedCamera>& cameras) {
  return DifferenceTests(calibration, kept, unseen, limits, cameras).Run();
}

}  // namespace dtr::calib
