// Against OpenCV: the same corners, the same model, the same loss must end at the same camera.
#include <gtest/gtest.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <ctime>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "calib/boards/detect.h"
#include "calib/solve/board_solve.h"
#include "calib/solve/choose_model.h"
#include "dtr/io/image_io.h"
#include "tests/calib/solve/synthetic_views.h"
#include "tests/support/test_data.h"

namespace dtr::calib {
namespace {

using namespace testing;
namespace fs = std::filesystem;
const Board kChessboard{Board::Kind::kChessboard, 9, 6, 1, 0, "", false};
constexpr double kSameRms = 1e-3;    // relative; what is asked of it
constexpr double kPublished = 5e-4;  // px: the published figures have three decimals

fs::path Folder() { return dtr::testing::DataFolder() / "chessboard_stereo_640x480"; }

std::vector<BoardView> Views(const std::string& side) {
  std::vector<BoardView> views;
  for (int i = 1; i <= 14; ++i) {
    const std::string name = side + (i < 10 ? "0" : "") + std::to_string(i) + ".jpg";
    const Detection found = DetectBoard(GreyOf(io::ReadImage(Folder() / name)), kChessboard);
    EXPECT_EQ(found.corners.size(), 54u) << name << ": " << found.reason;
    views.push_back({name, found.corners, found.noise_px});
  }
  return views;
}

struct OpenCvResult {
  double rms_px = 0, cpu_s = 0;
  cv::Mat k, distortion;
};

// OpenCV stops after 30 steps if it is not told otherwise.
OpenCvResult SolveWithOpenCv(const Board& board, const std::vector<BoardView>& views, int flags,
                             int steps = 30) {
  std::vector<std::vector<cv::Point3f>> corners;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const BoardView& view : views) {
    corners.emplace_back();
    pixels.emplace_back();
    for (const BoardCorner& c : view.corners) {
      const Eigen::Vector3d p = board.Corner(c.id);
      corners.back().emplace_back(p.x(), p.y(), 0);
      pixels.back().emplace_back(c.pixel.x() - 0.5, c.pixel.y() - 0.5);
    }
  }
  OpenCvResult result;
  std::vector<cv::Mat> rotations, translations;
  const std::clock_t start = std::clock();
  result.rms_px = cv::calibrateCamera(
      corners, pixels, {640, 480}, result.k, result.distortion, rotations, translations, flags,
      {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, steps, DBL_EPSILON});
  result.cpu_s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  return result;
}

TEST(OpenCvParity, TheChessboardSetHasOpenCvsTrainingRms) {
  DTR_REQUIRE_DATA(Folder());
  const std::pair<const char*, double> sides[] = {{"left", 0.187}, {"right", 0.192}};
  for (const auto& [side, published_px] : sides) {
    const auto views = Views(side);
    const std::pair<BoardModel, int> models[] = {{BoardModel::kBrown4, cv::CALIB_FIX_K3},
                                                 {BoardModel::kBrown5, 0}};
    for (const auto& [model, flags] : models) {
      const OpenCvResult theirs = SolveWithOpenCv(kChessboard, views, flags);
      SolveOptions options;
      options.loss = Loss::kQuadratic;
      const std::clock_t start = std::clock();
      const BoardSolution ours = SolveBoard(kChessboard, views, 640, 480, model, options);
      const double cpu_s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
      std::printf("%s %s: RMS %.6f px (OpenCV %.6f), %.2f s CPU (OpenCV %.2f s), sigma f %.2f px\n",
                  side, NameOf(model).c_str(), ours.rms_px, theirs.rms_px, cpu_s, theirs.cpu_s,
                  std::sqrt(ours.covariance(0, 0)));
      EXPECT_LE(ours.rms_px, theirs.rms_px * (1 + kSameRms)) << side << " " << NameOf(model);
      EXPECT_GE(ours.rms_px, theirs.rms_px * (1 - kSameRms)) << side << " " << NameOf(model);
      // Half a pixel between the conventions, nothing else.
      EXPECT_NEAR(ours.camera.params[2] - 0.5, theirs.k.at<double>(0, 2), 0.02);
      EXPECT_NEAR(ours.camera.params[3] - 0.5, theirs.k.at<double>(1, 2), 0.02);
      EXPECT_NEAR(ours.camera.params[0], theirs.k.at<double>(0, 0), 0.02);
      if (model == BoardModel::kBrown5) {
        EXPECT_NEAR(ours.rms_px, published_px, kPublished) << side;
      }
    }
  }
}

// The lens of `k` and `distortion` as ours; the first pixel's centre at 0.5.
LensCamera LensOf(const OpenCvResult& result) {
  LensCamera lens{CameraModel::kFullOpenCv, 640, 480, std::vector<double>(12, 0)};
  lens.params[0] = result.k.at<double>(0, 0);
  lens.params[1] = result.k.at<double>(1, 1);
  lens.params[2] = result.k.at<double>(0, 2) + 0.5;
  lens.params[3] = result.k.at<double>(1, 2) + 0.5;
  const auto count = std::min<size_t>(8, result.distortion.total());
  for (size_t i = 0; i < count; ++i) {
    lens.params[4 + i] = result.distortion.at<double>(static_cast<int>(i));
  }
  return lens;
}

// RMS of views that OpenCV's solve of the other folds predicts, the boards' poses alone fitted:
// what ChooseModel does with ours.
double HeldOutByOpenCv(const std::vector<BoardView>& views, size_t folds, int flags) {
  double squares = 0;
  int corners = 0;
  for (size_t fold = 0; fold < folds; ++fold) {
    std::vector<BoardView> training;
    for (size_t i = 0; i < views.size(); ++i) {
      if (i % folds != fold) training.push_back(views[i]);
    }
    const LensCamera lens = LensOf(SolveWithOpenCv(kChessboard, training, flags));
    for (size_t i = fold; i < views.size(); i += folds) {
      const auto pose = SolvePose(kChessboard, views[i], lens);
      for (const BoardCorner& corner : views[i].corners) {
        const auto pixel = lens.PixelFromCam(pose.value() * kChessboard.Corner(corner.id));
        squares += (pixel.value() - corner.pixel).squaredNorm();
        ++corners;
      }
    }
  }
  return std::sqrt(squares / corners);
}

TEST(OpenCvParity, TheChosenModelPredictsUnseenViewsAsWellAsOpenCvsBest) {
  DTR_REQUIRE_DATA(Folder());
  for (const char* side : {"left", "right"}) {
    const auto views = Views(side);
    const ChoiceOptions options;
    const ModelChoice choice = ChooseModel(kChessboard, views, 640, 480, options);
    const auto folds = std::min(views.size(), static_cast<size_t>(options.folds));
    double best = std::numeric_limits<double>::infinity();
    for (const auto& [name, flags] :
         {std::pair{"pinhole", cv::CALIB_FIX_K1 | cv::CALIB_FIX_K2 | cv::CALIB_FIX_K3 |
                                   cv::CALIB_ZERO_TANGENT_DIST},
          std::pair{"4", static_cast<int>(cv::CALIB_FIX_K3)}, std::pair{"5", 0},
          std::pair{"8", static_cast<int>(cv::CALIB_RATIONAL_MODEL)}}) {
      const double held_out = HeldOutByOpenCv(views, folds, flags);
      std::printf("%s, OpenCV's %s: held out %.4f px\n", side, name, held_out);
      best = std::min(best, held_out);
    }
    const ModelScore &chosen = choice.scores[choice.chosen], &ours = choice.scores[choice.best];
    std::printf("%s, ours: chosen %s %.4f px, best %s %.4f px, difference from %.4f px\n", side,
                NameOf(chosen.model).c_str(), chosen.held_out_rms_px, NameOf(ours.model).c_str(),
                ours.held_out_rms_px, chosen.low_px);
    EXPECT_LE(chosen.low_px, 0);  // a tie with our best, inside the bootstrap interval,
    // and with OpenCV's best (low_px is the interval's lower end: how much better chance allows).
    EXPECT_LE(chosen.held_out_rms_px + chosen.low_px, best * (1 + kSameRms));
  }
}

// OpenCV's rational model: k1, k2, p1, p2, k3, k4, k5, k6, the first pixel's centre at 0.
Eigen::Vector2d DrawnByOpenCv(const Eigen::Vector3d& p_in_cam, const cv::Mat& k,
                              const cv::Mat& distortion) {
  std::vector<cv::Point2d> pixels;
  cv::projectPoints(std::vector<cv::Point3d>{{p_in_cam.x(), p_in_cam.y(), p_in_cam.z()}},
                    cv::Mat::zeros(3, 1, CV_64F), cv::Mat::zeros(3, 1, CV_64F), k, distortion,
                    pixels);
  return {pixels[0].x + 0.5, pixels[0].y + 0.5};
}

TEST(OpenCvParity, TheRationalModelDrawsPointsWhereOpenCvDoes) {
  constexpr double kSamePx = 1e-9;  // double precision, with room for sums in another order
  const LensCamera camera = TypicalCamera(BoardModel::kBrown8);
  const auto& p = camera.params;
  const cv::Mat k = (cv::Mat_<double>(3, 3) << p[0], 0, p[2] - 0.5, 0, p[1], p[3] - 0.5, 0, 0, 1);
  const cv::Mat distortion(std::vector<double>(p.begin() + 4, p.end()), true);
  Random random(4);
  int drawn = 0;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d point(random.Uniform(-0.6, 0.6), random.Uniform(-0.45, 0.45), 1);
    const double depth = random.Uniform(0.1, 50);
    const auto ours = camera.PixelFromCam(depth * point);
    if (!ours) continue;
    ++drawn;
    EXPECT_LT((*ours - DrawnByOpenCv(depth * point, k, distortion)).norm(), kSamePx);
    const auto ray = camera.RayFromPixel(*ours);
    ASSERT_TRUE(ray);
    EXPECT_LT((*ray - point.normalized()).norm(), kSamePx);
  }
  EXPECT_EQ(drawn, 1000);
}

TEST(OpenCvParity, TheRationalModelIsSolvedAsOpenCvDoes) {
  constexpr double kNoisePx = 0.1;
  constexpr double kOpenCvRounding = 1e-4;  // relative; pixels rounded to 3e-5 make 5e-6
  const LensCamera truth = TypicalCamera(BoardModel::kBrown8);
  for (const std::uint64_t seed : {1, 2, 3}) {
    const auto views = Noisy(ExactViews(truth, 30, seed).views, kNoisePx, seed + 10);
    SolveOptions options;
    options.loss = Loss::kQuadratic;
    const BoardSolution ours = SolveBoard(kBoard, views, 640, 480, BoardModel::kBrown8, options);
    const OpenCvResult theirs = SolveWithOpenCv(kBoard, views, cv::CALIB_RATIONAL_MODEL, 300);
    std::printf("brown8, seed %d: RMS %.6f px (OpenCV %.6f)\n", static_cast<int>(seed), ours.rms_px,
                theirs.rms_px);
    // It takes pixels as floats, and may stop short of the minimum, where coefficients hardly
    // matter; we must not.
    EXPECT_LE(ours.rms_px, theirs.rms_px * (1 + kOpenCvRounding));
    EXPECT_GE(ours.rms_px, theirs.rms_px * (1 - kSameRms));
    // Numerator and denominator make up for each other: the lenses are compared by what they draw
    // where boards were seen.
    double most_px = 0;
    for (double x = 60; x < 600; x += 40) {
      for (double y = 60; y < 440; y += 40) {
        const auto ray = ours.camera.RayFromPixel({x, y});
        ASSERT_TRUE(ray);
        const Eigen::Vector2d other = DrawnByOpenCv(*ray, theirs.k, theirs.distortion);
        most_px = std::max(most_px, (other - Eigen::Vector2d(x, y)).norm());
      }
    }
    std::printf("  lenses differ by %.4f px at most\n", most_px);
    EXPECT_LT(most_px, 0.01);  // 1e-4 seen
  }
}

}  // namespace
}  // namespace dtr::calib
