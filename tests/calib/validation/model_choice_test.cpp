// A widely used set of photos of a chessboard that leaves the image's corners empty.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <algorithm>
#include <filesystem>

#include "calib/boards/detect.h"
#include "calib/lens_map.h"
#include "calib/solve/choose_model.h"
#include "calib/solve/model_spread.h"
#include "calib/validation/boards.h"
#include "calib/validation/projection.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/image_io.h"
#include "tests/support/test_data.h"

namespace dtr::calib {
namespace {

namespace fs = std::filesystem;

const Board kPhotoBoard{Board::Kind::kChessboard, 9, 6, 1, 0, "", false};
constexpr int kWidth = 1280, kHeight = 720;

fs::path Photos() { return dtr::testing::DataFolder() / "field/lens_auto_fisheye/photos"; }

const std::vector<BoardView>& Views() {
  static const std::vector<BoardView> kViews = [&] {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(Photos())) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    std::vector<Detection> found(files.size());
    ParallelFor(0, static_cast<int>(files.size()), [&](int i) {
      const auto at = static_cast<size_t>(i);
      const ImageRgb8 image = io::ReadImage(files[at]);
      if (image.width() != kWidth || image.height() != kHeight) return;  // two are a pixel larger
      DetectOptions quads;
      quads.detector = ChessboardDetector::kQuads;
      found[at] = DetectBoard(GreyOf(image), kPhotoBoard, quads);
    });
    std::vector<BoardView> views;
    for (size_t i = 0; i < files.size(); ++i) {
      if (found[i].corners.empty()) continue;
      views.push_back({files[i].filename().string(), found[i].corners, found[i].noise_px});
    }
    return views;
  }();
  return kViews;
}

// Every corner counted, as OpenCV does: OpenCvParity tests that it is the same camera.
BoardSolution Solved(const std::vector<BoardView>& views, BoardModel model) {
  SolveOptions options;
  options.loss = Loss::kQuadratic;
  options.cover_image = false;
  return SolveBoard(kPhotoBoard, views, kWidth, kHeight, model, options);
}

// Without the corners that `solution` calls outliers: with OpenCV 4.10 some of these are wrong.
std::vector<BoardView> WithoutOutliers(std::vector<BoardView> views,
                                       const BoardSolution& solution) {
  for (const SolvedView& solved : solution.views) {
    for (BoardView& view : views) {
      if (view.name != solved.name) continue;
      std::erase_if(view.corners, [&](const BoardCorner& corner) {
        return std::binary_search(solved.outliers.begin(), solved.outliers.end(), corner.id);
      });
    }
  }
  return views;
}

// Distance over the whole image after the best rotation about the camera's centre.
std::vector<double> Differences(const LensCamera& a, const LensCamera& b) {
  std::vector<Eigen::Vector3d> rays_a, rays_b;
  const ImageMap map = EmptyMap(a);
  for (int row = 0; row < map.rows; ++row) {
    for (int column = 0; column < map.columns; ++column) {
      const auto pixel = CellCentre(map, a, column, row);
      rays_a.push_back(*a.RayFromPixel(pixel));
      rays_b.push_back(*b.RayFromPixel(pixel));
    }
  }
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < rays_a.size(); ++i) sum += rays_b[i] * rays_a[i].transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d b_from_a = svd.matrixU() * svd.matrixV().transpose();
  std::vector<double> lengths;
  for (const Eigen::Vector3d& ray : rays_a) {
    lengths.push_back(
        (*LensMap(b).PixelFromCam(b_from_a * ray) - *LensMap(a).PixelFromCam(ray)).norm());
  }
  return lengths;
}

double RmsOf(const std::vector<double>& lengths) {
  double sum = 0;
  for (const double length : lengths) sum += length * length;
  return std::sqrt(sum / static_cast<double>(lengths.size()));
}

TEST(ModelChoiceOfPhotos, AnOrdinaryLensIsWithinAPixelOfOpenCvsOverTheWholeImage) {
  DTR_REQUIRE_DATA(Photos());
  const auto& views = Views();
  ASSERT_GE(views.size(), 15u);
  ChoiceOptions options;
  options.folds = 5;
  const ModelChoice choice = ChooseModel(kPhotoBoard, views, kWidth, kHeight, options);
  const ModelScore& chosen = choice.scores[choice.chosen];
  ASSERT_EQ(NameOf(chosen.model), "brown4");
  for (const ModelScore& score : choice.scores) {
    if (score.model != BoardModel::kFisheye) continue;
    EXPECT_THAT(score.refused, ::testing::HasSubstr("bends between the outermost corner seen"));
  }
  const BoardSolution of_opencv =
      Solved(WithoutOutliers(views, *chosen.solution), BoardModel::kBrown4);
  EXPECT_LT(RmsOf(Differences(of_opencv.camera, chosen.solution->camera)), 1);
}

TEST(ModelChoiceOfPhotos, AModelThatBendsBeyondTheCornersSeenStatesHowFarOthersAreFromIt) {
  DTR_REQUIRE_DATA(Photos());
  const auto& views = Views();
  const std::vector<std::vector<int>> none(views.size());
  const auto others = OtherModels(kPhotoBoard, BoardModel::kFisheye, kWidth, kHeight, views, none);
  const auto brown4 = std::find_if(others.begin(), others.end(), [](const OtherModel& other) {
    return other.model == BoardModel::kBrown4;
  });
  ASSERT_NE(brown4, others.end());
  constexpr double kFar = 1e6;
  const ImageMap spread = SpreadMap(brown4->own, others, kFar);
  // In the middle models agree, at the corners of the image they do not.
  EXPECT_LT(spread.Median(), 3);
  EXPECT_GT(spread.Largest(), 30);
  for (int row = 0; row < spread.rows; ++row) {
    for (int column = 0; column < spread.columns; ++column) {
      const auto pixel = CellCentre(spread, brown4->own, column, row);
      EXPECT_GE(spread.values[static_cast<size_t>(row * spread.columns + column)],
                *brown4->DifferenceAt(pixel, kFar));
    }
  }
}

}  // namespace
}  // namespace dtr::calib
