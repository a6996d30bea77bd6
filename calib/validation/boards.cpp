#include "calib/validation/boards.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/distributions.h"
#include "calib/precision.h"
#include "calib/validation/board_differences.h"
#include "calib/validation/board_patterns.h"
#include "calib/validation/board_residuals.h"
#include "calib/validation/board_solves.h"
#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"
#include "dtr/base/parallel_for.h"

namespace dtr::calib {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kMinInRegion = 20;  // corners; below, a region's RMS is a guess
constexpr double kFar = 1000;     // times the boards' distance: as good as at infinity

// All that is tested, step by step.
class BoardValidator {
 public:
  BoardValidator(const ValidatedCalibration& calibration,
                 const std::optional<TestViews>& test_views, const BoardLimits& limits,
                 std::span<const double> distances, Progress* progress)
      : calibration_(calibration), test_views_(test_views), limits_(limits), progress_(progress) {
    if (progress_ != nullptr) progress_->Stage("validating the calibration", kSteps);
    report_.test_views = test_views.has_value();
    for (const RigCamera& camera : calibration.cameras) {
      report_.cameras.push_back({});
      report_.cameras.back().name = camera.name;
      for (const double distance : distances) {
        report_.cameras.back().uncertainty_at.push_back({distance, {}});
      }
    }
  }

  BoardValidation Run() {
    if (!calibration_.kept.empty()) {
      kept_ =
          SolveFresh(calibration_, calibration_.kept, calibration_.kept_frames, Loss::kQuadratic);
    } else {
      kept_.refused = "the file has no observations";
    }
    if (test_views_)
      fresh_ = SolveFresh(calibration_, test_views_->views, test_views_->frames, Loss::kRobust);
    if (kept_.solution) {
      report_.sigma_px = kept_.solution->sigma_px;
      report_.condition = kept_.solution->information.condition();
    }
    StepDone();
    FitStored();
    StepDone();
    TestResiduals();
    StepDone();
    for (Check& check : TestDifferences(calibration_, kept_, test_views_ ? &fresh_ : nullptr,
                                        limits_, report_.cameras)) {
      Add(std::move(check));
    }
    TestData();
    StepDone();
    TestTerms();
    TestUncertainty();
    StepDone();
    TestHalves();
    TestPatterns();
    StepDone();
    return std::move(report_);
  }

 private:
  static constexpr int kSteps = 6;

  void StepDone() {
    if (progress_ == nullptr) return;
    progress_->ThrowIfInterrupted();
    progress_->Update(++steps_done_);
  }

  void Add(Check check) { report_.tests.push_back(std::move(check)); }

  // The views that the stored calibration is held against.
  const std::vector<RigView>& Tested() const {
    return test_views_ ? test_views_->views : calibration_.kept;
  }
  size_t TestedFrames() const {
    return test_views_ ? test_views_->frames : calibration_.kept_frames;
  }

  void FitStored() {
    SolveOptions options;
    options.loss = test_views_ ? Loss::kRobust : Loss::kQuadratic;
    std::vector<LeftOut> left_out;
    fitted_ = FitFrames(calibration_.board, calibration_.cameras, Tested(), TestedFrames(), options,
                        left_out, &report_.flipped);
    AddResiduals(calibration_.board, fitted_, stored_);
    for (const LeftOut& item : left_out) {
      for (const RigView& view : Tested()) {
        if (view.seen.name == item.name) {
          stored_.outliers += static_cast<int>(view.seen.corners.size());
        }
      }
    }
    for (size_t c = 0; c < report_.cameras.size(); ++c) {
      ValidatedCamera& camera = report_.cameras[c];
      camera.stored = Summarise(stored_.by_camera.empty() ? std::vector<Eigen::Vector2d>{}
                                                          : stored_.by_camera[c]);
      camera.distance = BoardDistance(calibration_.board, fitted_, c);
      camera.coverage = CoverageOf(calibration_, c);
      camera.noise_px = MedianNoise(c);
      FillRegions(c);
      FillViews(c);
    }
  }

  double MedianNoise(size_t camera) const {
    std::vector<double> noise;
    for (const RigView& view : Tested()) {
      if (view.camera == camera && std::isfinite(view.seen.noise_px)) {
        noise.push_back(view.seen.noise_px);
      }
    }
    if (noise.empty()) return kNaN;
    return UpperMedian(noise);
  }

  void FillRegions(size_t c) {
    if (stored_.arrows.empty()) return;
    const LensCamera& lens = calibration_.cameras[c].camera;
    std::array<std::vector<Eigen::Vector2d>, kRegionsPerAxis * kRegionsPerAxis> regions;
    for (const ResidualArrow& arrow : stored_.arrows[c]) {
      const int row = CellOf(arrow.pixel.y(), lens.height_px, kRegionsPerAxis);
      const int column = CellOf(arrow.pixel.x(), lens.width_px, kRegionsPerAxis);
      regions[static_cast<size_t>(row * kRegionsPerAxis + column)].push_back(arrow.residual_px);
    }
    for (size_t i = 0; i < regions.size(); ++i) {
      report_.cameras[c].regions[i] = Summarise(regions[i]);
    }
  }

  void FillViews(size_t c) {
    ValidatedCamera& camera = report_.cameras[c];
    for (const RigView& view : fitted_.views) {
      if (view.camera != c) continue;
      ValidatedView judged{
          view.seen.name,    0, 0, 0, 0, ArrowsOf(calibration_.board, fitted_, view),
          view.seen.rotation};
      std::vector<Eigen::Vector2d> residuals;
      for (const ResidualArrow& arrow : judged.arrows) residuals.push_back(arrow.residual_px);
      const ResidualStats stats = Summarise(residuals);
      judged.rms_px = stats.rms_px;
      judged.worst_px = stats.worst_px;
      judged.corners = stats.count;
      judged.outliers = static_cast<int>(view.seen.corners.size() - residuals.size());
      camera.views.push_back(std::move(judged));
    }
    std::stable_sort(camera.views.begin(), camera.views.end(),
                     [](const auto& a, const auto& b) { return a.rms_px > b.rms_px; });
  }

  void TestResiduals() {
    BoardResiduals judged = stored_;
    std::string refused;
    if (!test_views_) {
      judged = HeldOut(calibration_, &refused);
      for (size_t c = 0; c < report_.cameras.size(); ++c) {
        report_.cameras[c].held_out = Summarise(judged.by_camera[c]);
      }
    }
    const char* rms_name = test_views_ ? "test_rms_px" : "held_out_rms_px";
    const char* ratio_name = test_views_ ? "test_rms_ratio" : "held_out_rms_ratio";
    const size_t frames =
        test_views_ ? OrderOfFrames(fitted_.views).size() : OrderOfFrames(calibration_.kept).size();
    if (judged.corners == 0 || !refused.empty()) {
      const std::string why = refused.empty() ? "no view could be predicted" : refused;
      Add(NotTested(rms_name, limits_.max_rms_px, why));
      Add(NotTested(ratio_name, limits_.max_rms_ratio, why));
    } else {
      std::string noise;
      for (const ValidatedCamera& camera : report_.cameras) {
        noise +=
            fmt::format("{}{}: {:.3f}", noise.empty() ? "" : ", ", camera.name, camera.noise_px);
      }
      Add(AtMost(rms_name, std::sqrt(judged.squares / judged.corners), limits_.max_rms_px,
                 fmt::format("{} corners {}; noise of the pixels alone, per coordinate: {}",
                             judged.corners,
                             test_views_ ? "that the calibration has not seen"
                                         : "predicted by solves of the other views",
                             noise)));
      const double promised = kept_.solution    ? kept_.solution->sigma_px
                              : fresh_.solution ? fresh_.solution->sigma_px
                                                : kNaN;
      Add(AtMost(ratio_name, SigmaOf(judged, frames) / std::max(promised, kPrecisionPx),
                 limits_.max_rms_ratio,
                 fmt::format("scatter per coordinate over the {:.4f} px that the solve promises",
                             promised)));
    }
    TestRegions();
    const double all = stored_.corners + stored_.outliers;
    Add(AtMost("outlier_share", all > 0 ? stored_.outliers / all : kNaN, limits_.max_outlier_share,
               fmt::format("{} of {} corners are left out as outliers", stored_.outliers, all)));
  }

  void TestRegions() {
    double worst = -1;
    std::string where = "no region has enough corners";
    for (const ValidatedCamera& camera : report_.cameras) {
      std::vector<double> rms;
      for (const ResidualStats& region : camera.regions) {
        if (region.count >= kMinInRegion) rms.push_back(region.rms_px);
      }
      if (rms.empty()) continue;
      const double typical = UpperMedian(rms);
      for (size_t i = 0; i < camera.regions.size(); ++i) {
        const ResidualStats& region = camera.regions[i];
        // No region is out of line by what misleads nobody.
        const double ratio = region.rms_px / std::max(typical, kMinOutlierSigmaPx);
        if (region.count < kMinInRegion || !(ratio > worst)) continue;
        worst = ratio;
        where = fmt::format(
            "{}: row {}, column {} of 3 x 3 has RMS {:.3f} px, the median region "
            "{:.3f} px",
            camera.name, i / kRegionsPerAxis + 1, i % kRegionsPerAxis + 1, region.rms_px, typical);
      }
    }
    Add(AtMost("worst_region_ratio", worst >= 0 ? worst : kNaN, limits_.max_region_ratio, where));
  }

  void TestData() {
    Rig fitted = fitted_;
    if (test_views_ && kept_.solution) fitted = kept_.solution->rig;
    Add(TestBoardsFromBehind(calibration_, fitted_));
    if (calibration_.kept.empty()) return;
    Add(TestViewCount(calibration_, limits_.min_views));
    Add(TestRepeats(calibration_, kept_.solution ? kept_.solution->sigma_px : 0));
    Add(TestCoverage(calibration_, limits_.min_coverage));
    Add(TestTilt(calibration_, fitted, limits_.min_tilt_deg));
  }

  // What the tests below are made on: the views that made the calibration, where they are kept.
  const Fresh& Base() const { return calibration_.kept.empty() ? fresh_ : kept_; }

  // Of one camera's own views: what the other cameras of a rig add to its lens is little.
  std::vector<OtherModel> OtherModelsOf(const RigSolution& solution, size_t camera) const {
    if (!calibration_.free_lenses) return {};
    const RigCamera& own = solution.rig.cameras[camera];
    std::vector<BoardView> views;
    std::vector<std::vector<int>> outliers;
    for (const RigView& view : solution.rig.views) {
      if (view.camera != camera) continue;
      views.push_back(view.seen);
      outliers.push_back(view.outliers);
    }
    return OtherModels(calibration_.board, own.model, own.camera.width_px, own.camera.height_px,
                       views, outliers);
  }

  // A coefficient of which the corners say little more than is known of any camera.
  void TestTerms() {
    if (!calibration_.free_lenses || calibration_.kept.empty()) return;
    const char* name = "undetermined_terms";
    if (!Base().solution) {
      Add(NotTested(name, limits_.max_term_share, Base().refused));
      return;
    }
    const RigSolution& solution = *Base().solution;
    Check check = AtMost(name, 0, limits_.max_term_share, "no camera has a radial coefficient");
    for (size_t c = 0; c < solution.rig.cameras.size(); ++c) {
      const RigCamera& camera = solution.rig.cameras[c];
      const int at = solution.layout.LensAt(c), count = FreeParameterCount(camera.model);
      const Eigen::MatrixXd covariance = solution.covariance.block(at, at, count, count);
      const TermUncertainty term = MostUncertainTerm(camera.model, camera.camera, covariance);
      if (term.index < 0 || term.share <= check.value) continue;
      check = AtMost(
          name, term.share, limits_.max_term_share,
          fmt::format("{}: {} ({}); its standard deviation moves the image's corner by "
                      "this share of its distance",
                      camera.name, TextOfTerm(camera.model, camera.camera, covariance, term.index),
                      NameOf(camera.model)));
    }
    Add(std::move(check));
  }

  void TestUncertainty() {
    if (!Base().solution) {
      Add(NotTested("projection_uncertainty_px", limits_.max_uncertainty_px, Base().refused));
      Add(NotTested("far_projection_uncertainty_px", limits_.max_far_uncertainty_px,
                    Base().refused));
      return;
    }
    const RigSolution& solution = *Base().solution;
    const ProjectionSensitivity sensitivity(solution);
    ParallelFor(0, static_cast<int>(report_.cameras.size()), [&](int c) {
      const auto at = static_cast<size_t>(c);
      ValidatedCamera& camera = report_.cameras[at];
      const std::vector<OtherModel> others = OtherModelsOf(solution, at);
      const auto map_at = [&](double distance) {
        return Combined(UncertaintyMap(solution, sensitivity, solution.covariance, at, distance),
                        SpreadMap(solution.rig.cameras[at].camera, others, distance));
      };
      const double distance = BoardDistance(calibration_.board, solution.rig, at);
      camera.near_uncertainty = map_at(distance);
      camera.far_uncertainty = map_at(kFar * distance);
      camera.model_spread =
          SpreadMap(solution.rig.cameras[at].camera, others, distance, &camera.spread_model);
      for (UncertaintyAt& chosen : camera.uncertainty_at) chosen.map = map_at(chosen.distance);
    });
    AddUncertainty("projection_uncertainty_px", limits_.max_uncertainty_px, "the boards' distance",
                   [](const ValidatedCamera& c) -> const ImageMap& { return c.near_uncertainty; });
    AddUncertainty("far_projection_uncertainty_px", limits_.max_far_uncertainty_px, "infinity",
                   [](const ValidatedCamera& c) -> const ImageMap& { return c.far_uncertainty; });
  }

  template <typename MapOf>
  void AddUncertainty(const char* name, double limit, const char* where, const MapOf& map_of) {
    Check check{name, kNaN, limit, false, "no pixel has a ray"};
    for (const ValidatedCamera& camera : report_.cameras) {
      // A lens that has no ray for a pixel that it should show does not know where it looks; what
      // could not be computed is the worst, not the best.
      double value = map_of(camera).Quantile(kMaxOfImage);
      const bool has_rays = std::isfinite(value);
      if (!has_rays) value = std::numeric_limits<double>::infinity();
      if (value <= check.value) continue;
      check.value = value;
      check.reason = fmt::format(
          "{}: standard deviation of a projection at {}, exceeded in 5 % of "
          "the image; median {:.3g} px, worst {:.3g} px{}{}",
          camera.name, where, map_of(camera).Median(), map_of(camera).Largest(),
          has_rays ? "" : " of those that have a ray: more than 5 % have none",
          camera.spread_model.empty()
              ? std::string()
              : fmt::format("; in it the choice of the model: {} fits the corners as well and "
                            "differs by up to {:.3g} px at the boards' distance",
                            camera.spread_model, camera.model_spread.Largest()));
    }
    check.passed = check.value <= limit;
    Add(std::move(check));
  }

  void TestHalves() {
    const char* name = "min_halves_p";
    const std::vector<RigView>& views = calibration_.kept.empty() ? Tested() : calibration_.kept;
    const size_t frames = calibration_.kept.empty() ? TestedFrames() : calibration_.kept_frames;
    const auto order = OrderOfFrames(views);
    std::array<Fresh, 2> halves;
    ParallelFor(0, 2, [&](int half) {
      const auto in_half = [&](size_t f) { return order.at(f) % 2 == static_cast<size_t>(half); };
      halves[static_cast<size_t>(half)] =
          SolveFresh(calibration_, FramesWhere(views, in_half), frames,
                     calibration_.kept.empty() ? Loss::kRobust : Loss::kQuadratic);
    });
    for (const Fresh& half : halves) {
      if (half.solution) continue;
      Add(NotTested(name, limits_.min_p, "half of the views: " + half.refused));
      return;
    }
    const RigSolution &a = *halves[0].solution, &b = *halves[1].solution;
    const Eigen::VectorXd difference = Difference(a.layout, a.rig.cameras, b.rig.cameras);
    const Eigen::MatrixXd covariance = a.covariance + b.covariance;
    const double distance = Distance(difference, covariance, 0, a.layout.size());
    const double unknowns = a.layout.size();
    const ProjectionSensitivity sensitivity(a);
    double shift = 0, predicted = 0, most = 0;
    for (size_t c = 0; c < report_.cameras.size(); ++c) {
      const double board = BoardDistance(calibration_.board, a.rig, c);
      const ImageMap shifts = ShiftMap(a, sensitivity, difference, c, board);
      shift = std::max(shift, shifts.Largest());
      most = std::max(most, shifts.Quantile(kMaxOfImage));
      predicted =
          std::max(predicted, UncertaintyMap(a, sensitivity, covariance, c, board).Largest());
    }
    const double p =
        FisherSurvival(distance * distance / unknowns, unknowns, std::min(a.freedom, b.freedom));
    // Errors of real corners go together, and then the least difference is no chance. Half of the
    // views err sqrt(2) times as much as all, and two halves differ by sqrt(2) of that: up to twice
    // the limit the whole is within it.
    const double harmless = 2 * limits_.max_uncertainty_px;
    const bool small = p < limits_.min_p && most <= harmless;
    Add(AtLeast(
        name, small ? 1 : p, limits_.min_p,
        fmt::format("two halves, solved apart, differ by {:.3g} px at most, in 95 % of the "
                    "image by {:.3g} px, predicted sigma {:.3g} px; {}",
                    shift, most, predicted,
                    small
                        ? fmt::format("no chance (p = {:.2g}), but less than {} px: the "
                                      "whole is within its limit",
                                      p, harmless)
                        : std::string("the value is the probability of this or more by chance"))));
  }

  void TestPatterns() {
    for (Check& check : PatternChecks(calibration_.board, Base(), limits_)) Add(std::move(check));
  }

  const ValidatedCalibration& calibration_;
  const std::optional<TestViews>& test_views_;
  const BoardLimits& limits_;
  Progress* progress_;
  int steps_done_ = 0;
  BoardValidation report_;
  Fresh kept_, fresh_;
  Rig fitted_;
  BoardResiduals stored_;
};

}  // namespace

BoardValidation ValidateBoards(const ValidatedCalibration& calibration,
                               const std::optional<TestViews>& test_views,
                               const BoardLimits& limits, std::span<const double> distances,
                               Progress* progress) {
  const auto& views = test_views ? test_views->views : calibration.kept;
  for (size_t c = 0; c < calibration.cameras.size(); ++c) {
    if (std::none_of(views.begin(), views.end(), [&](const auto& v) { return v.camera == c; })) {
      throw Error(fmt::format("validate: camera {}: expected views of the board {}, found none",
                              calibration.cameras[c].name,
                              test_views ? "among the images" : "in the file; give `images`"));
    }
  }
  return BoardValidator(calibration, test_views, limits, distances, progress).Run();
}

}  // namespace dtr::calib
