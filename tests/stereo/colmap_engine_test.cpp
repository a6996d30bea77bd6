// Depth maps that COLMAP made: whose pixel a number belongs to, and which maps are rejected.
#include "stereo/colmap/colmap_engine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "calib/colmap/dense.h"
#include "calib/colmap/export.h"
#include "calib/colmap/model_io.h"
#include "datasets/exact/stereo_quality.h"
#include "dtr/base/files.h"
#include "tests/support/test_data.h"
#include "tests/support/truncation.h"

namespace dtr::stereo::testing {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const PinholeCamera kCamera(160, 120, 150, 150, 81.3, 58.7);

std::string Bytes(int width, int height, const std::vector<float>& numbers, int channels = 1) {
  std::string bytes =
      std::to_string(width) + "&" + std::to_string(height) + "&" + std::to_string(channels) + "&";
  bytes.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(float));
  return bytes;
}

/// What COLMAP's PatchMatch finds for a pixel whose counterpart it knows exactly. It takes the
/// indices of pixels for their coordinates in both views (patch_match_cuda.cu, COLMAP issue 1515):
/// of the depths along the ray through (column, row), the one whose projection comes nearest to the
/// index where the counterpart lies.
double DepthAsColmapFindsIt(const Shot& reference, const Shot& source, int column, int row) {
  const Vector3d seen =
      reference.cam_from_world.Inverse() *
      reference.camera.CamFromPixel({column + 0.5, row + 0.5}, reference.truth(column, row),
                                    DepthKind::kPlaneZ);
  const Vector2d index =
      *source.camera.PixelFromCam(source.cam_from_world * seen) - Vector2d(0.5, 0.5);
  const Pose source_from_reference = source.cam_from_world * reference.cam_from_world.Inverse();
  const auto miss = [&](double z) {
    const Vector3d p = reference.camera.CamFromPixel(Vector2d(column, row), z, DepthKind::kPlaneZ);
    return (*source.camera.PixelFromCam(source_from_reference * p) - index).squaredNorm();
  };
  // Golden section over inverse depth; the miss has one minimum along an epipolar line.
  constexpr double kRatio = 0.6180339887498949;
  double low = 0.5 / reference.truth(column, row), high = 2.0 / reference.truth(column, row);
  for (int i = 0; i < 60; ++i) {
    const double a = high - kRatio * (high - low), b = low + kRatio * (high - low);
    (miss(1 / a) < miss(1 / b) ? high : low) = miss(1 / a) < miss(1 / b) ? b : a;
  }
  return 2 / (low + high);
}

/// A workspace of some shots, and the views it belongs to.
class Workspace {
 public:
  explicit Workspace(const std::vector<Shot>& shots) : views(ViewsOf(shots)) {
    calib::SfmModel model;
    model.cameras[1] = colmap::FromPinhole(shots[0].camera);
    for (size_t i = 0; i < shots.size(); ++i) {
      names.push_back("photo" + std::to_string(i) + ".jpg");
      calib::SfmImage image;
      image.id = static_cast<std::uint32_t>(i + 1);
      image.name = names.back();
      image.camera_id = 1;
      image.cam_from_world = shots[i].cam_from_world;
      model.images.push_back(std::move(image));
    }
    colmap::WriteDenseWorkspace(folder_.path(), model);
  }
  void Put(int view, const std::string& bytes, const std::string& kind = "geometric") {
    WriteFileAtomically(Map(view, kind), bytes);
  }
  fs::path Map(int view, const std::string& kind = "geometric") const {
    return folder_.path() / "stereo/depth_maps" /
           (names[static_cast<size_t>(view)] + "." + kind + ".bin");
  }
  ColmapEngine Engine(const Vector3d& origin = Vector3d::Zero()) const {
    return ColmapEngine(folder_.path(), names, views, origin);
  }

  std::vector<std::string> names;
  std::vector<StereoView> views;

 private:
  dtr::testing::TemporaryFolder folder_;
};

/// Two cameras that turn towards a slanted plane, one higher and nearer than the other.
std::vector<Shot> TwoShots() {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.12, Vector3d(0.2, 1, 0.1).normalized()));
  const Vector3d centre(0.6, 0.1, 0.15);
  const Vector3d normal(1.2, 0.9, 1);
  return ShotsOf(Plane(normal.normalized(), 4 / normal.norm()), kCamera,
                 {Facing({0, 0, 0}), Pose{turn, -(turn * centre)}});
}

double MedianMissPx(const std::vector<Shot>& shots, const DepthImage& depth, double shift_px) {
  const double px = kCamera.fx_px() * shots[1].cam_from_world.TargetOriginInSource().norm();
  const Vector3d normal = Vector3d(1.2, 0.9, 1).normalized();
  const double offset = 4 / Vector3d(1.2, 0.9, 1).norm();
  std::vector<double> misses;
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      if (DepthImage::IsHole(depth(x, y))) continue;
      const Vector3d ray = kCamera.RayFromPixel({x + shift_px, y + shift_px});
      misses.push_back(std::abs(px * (1.0 / depth(x, y) - normal.dot(ray) / offset)));
    }
  }
  const auto middle = misses.begin() + static_cast<std::ptrdiff_t>(misses.size() / 2);
  std::nth_element(misses.begin(), middle, misses.end());
  return *middle;
}

TEST(ColmapEngine, ANumberBelongsToTheCentreOfItsPixel) {
  const std::vector<Shot> shots = TwoShots();
  Workspace workspace(shots);
  std::vector<float> numbers;
  for (int y = 0; y < kCamera.height_px(); ++y) {
    for (int x = 0; x < kCamera.width_px(); ++x) {
      numbers.push_back(static_cast<float>(DepthAsColmapFindsIt(shots[0], shots[1], x, y)));
    }
  }
  workspace.Put(0, Bytes(kCamera.width_px(), kCamera.height_px(), numbers));
  const DepthEstimate estimate =
      workspace.Engine().Estimate(workspace.views, 0, std::vector<int>{1}, {1, 10}, {});
  // Pixels of disparity. What is left at the centre comes of the cameras' turn; half a pixel off,
  // the plane's slope shows.
  constexpr double kResidualPx = 0.04, kSlipPx = 0.1;
  EXPECT_LT(MedianMissPx(shots, estimate.depth, 0.5), kResidualPx);
  EXPECT_GT(MedianMissPx(shots, estimate.depth, 0.0), kSlipPx);
  EXPECT_GT(MedianMissPx(shots, estimate.depth, 1.0), kSlipPx);
}

TEST(ColmapEngine, NumbersThatAreNoDepthAreHoles) {
  Workspace workspace(TwoShots());
  std::vector<float> numbers(160 * 120, 2.0f);
  numbers[0] = 0;
  numbers[1] = -1;
  numbers[2] = std::numeric_limits<float>::quiet_NaN();
  numbers[3] = std::numeric_limits<float>::infinity();
  workspace.Put(0, Bytes(160, 120, numbers));
  const DepthEstimate estimate =
      workspace.Engine().Estimate(workspace.views, 0, std::vector<int>{1}, {1, 10}, {});
  for (int x = 0; x < 4; ++x) {
    EXPECT_EQ(estimate.depth(x, 0), 0) << x;
    EXPECT_EQ(estimate.inverse_depth_sigma(x, 0), 0) << x;
  }
  EXPECT_EQ(estimate.depth(4, 0), 2.0f);
  const double baseline = workspace.views[1].cam_from_world.TargetOriginInSource().norm();
  EXPECT_FLOAT_EQ(estimate.inverse_depth_sigma(4, 0),
                  static_cast<float>(0.5 / (kCamera.fx_px() * baseline)));
}

TEST(ColmapEngine, AMapThatOthersWereNotHeldToIsTakenForWantOfABetterOne) {
  Workspace workspace(TwoShots());
  workspace.Put(0, Bytes(160, 120, std::vector<float>(160 * 120, 2.0f)));
  workspace.Put(0, Bytes(160, 120, std::vector<float>(160 * 120, 3.0f)), "photometric");
  workspace.Put(1, Bytes(160, 120, std::vector<float>(160 * 120, 4.0f)), "photometric");
  const ColmapEngine engine = workspace.Engine();
  EXPECT_EQ(engine.photometric_maps(), 1);
  const auto first = [&](int view, int other) {
    return engine.Estimate(workspace.views, view, std::vector<int>{other}, {1, 10}, {}).depth(9, 9);
  };
  EXPECT_EQ(first(0, 1), 2.0f);
  EXPECT_EQ(first(1, 0), 4.0f);
}

TEST(ColmapEngine, AViewWithoutAMapHasNoDepth) {
  const Workspace workspace(TwoShots());
  EXPECT_THROW(workspace.Engine().Estimate(workspace.views, 0, std::vector<int>{1}, {1, 10}, {}),
               NoUsablePair);
}

TEST(ColmapEngine, CamerasOfAnotherCalibrationAreRejected) {
  const Workspace workspace(TwoShots());
  const auto rejection = [&](const auto& change) {
    std::vector<StereoView> views = workspace.views;
    change(views[1]);
    Workspace other(TwoShots());
    other.views = views;
    try {
      other.Engine();
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  EXPECT_EQ(rejection([](StereoView&) {}), "none");
  EXPECT_THAT(rejection([](StereoView& v) { v.camera = PinholeCamera(80, 60, 75, 75, 40, 30); }),
              HasSubstr("view photo1.jpg: expected an image of 80x60, found 160x120"));
  EXPECT_THAT(
      rejection([](StereoView& v) { v.camera = PinholeCamera(160, 120, 150, 150, 81.8, 58.7); }),
      HasSubstr("expected its focal lengths and principal point, found 0.5"));
  EXPECT_THAT(rejection([](StereoView& v) {
                const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.01, Vector3d::UnitZ()));
                v.cam_from_world = Pose{turn, Vector3d::Zero()} * v.cam_from_world;
              }),
              HasSubstr("expected its rotation, found 1.5"));
  EXPECT_THAT(rejection([](StereoView& v) { v.cam_from_world.translation.x() += 0.01; }),
              HasSubstr("expected its centre, found 1."));
}

TEST(ColmapEngine, TheWorkspaceLiesInTheUsersWorld) {
  const Vector3d origin(1e6, -2e6, 300);
  Workspace workspace(TwoShots());
  EXPECT_THROW(workspace.Engine(origin), Error);
  for (StereoView& view : workspace.views) {
    view.cam_from_world.translation += view.cam_from_world.rotation * origin;
  }
  EXPECT_NO_THROW(workspace.Engine(origin));
}

TEST(ColmapEngine, ANameMayHaveAnotherExtensionButNotBeMissing) {
  Workspace workspace(TwoShots());
  workspace.names[0] = "photo0.png";
  EXPECT_NO_THROW(workspace.Engine());
  workspace.names[0] = "photo7.jpg";
  EXPECT_THAT([&] { workspace.Engine(); },
              ThrowsMessage<Error>(HasSubstr("view photo7.jpg: expected an image of this name")));
}

TEST(DenseDepth, EveryPrefixIsRejected) {
  const dtr::testing::TemporaryFolder folder;
  const fs::path file = folder / "map.bin";
  WriteFileAtomically(file, Bytes(7, 5, std::vector<float>(35, 1.5f)));
  dtr::testing::ExpectEveryPrefixIsAnError(file, 1, [&] { colmap::ReadDenseDepth(file, 7, 5); });
}

TEST(DenseDepth, WhatIsNoMapOfThisSizeIsRejectedBeforeAnythingIsAllocated) {
  const dtr::testing::TemporaryFolder folder;
  const fs::path file = folder / "map.bin";
  const auto rejection = [&](const std::string& bytes) {
    WriteFileAtomically(file, bytes);
    try {
      colmap::ReadDenseDepth(file, 7, 5);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  const std::vector<float> numbers(35, 1.5f);
  EXPECT_EQ(rejection(Bytes(7, 5, numbers)), "none");
  EXPECT_THAT(rejection(Bytes(5, 7, numbers)), HasSubstr("expected a depth map of 7x5"));
  EXPECT_THAT(rejection(Bytes(7, 5, numbers, 3)), HasSubstr("found 7x5 and 3"));
  EXPECT_THAT(rejection(Bytes(2147483647, 2147483647, numbers)), HasSubstr("found 2147483647x"));
  for (const char* header : {"-7&5&1&", "7&0&1&", "99999999999&5&1&", "7 5 1 ", "7&5&1", "&&&", "",
                             "7&5&1x", "0x7&5&1&"}) {
    EXPECT_THAT(rejection(header + std::string(140, 'x')), HasSubstr("map.bin: expected"))
        << header;
  }
  EXPECT_THAT(rejection(Bytes(7, 5, std::vector<float>(36, 1.5f))), HasSubstr("map.bin: expected"));
  EXPECT_THAT(rejection(Bytes(7, 5, numbers) + std::string(1 << 20, 'x')), HasSubstr("map.bin"));
}

}  // namespace
}  // namespace dtr::stereo::testing
