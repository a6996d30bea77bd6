#include "calib/lens_camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <stdexcept>

#include "calib/lens_map.h"
#include "tests/calib/lens_models.h"

namespace dtr::calib {
namespace {

using testing::kAllModels;
using testing::RandomLens;

constexpr double kHandWorkedPx = 1e-9;  // double; the worked numbers have ten digits
constexpr double kRoundTripPx = 1e-11;  // Newton to the last bits; worst of all draws 2.6e-13
constexpr double kOpenCvPx = 1e-9;      // the same formula in double, coordinates below 1000
constexpr int kDraws = 300;             // lenses per model; a second in all

TEST(CameraModel, NamesAndParameterCountsAreColmaps) {
  EXPECT_EQ(NameOf(CameraModel::kOpenCv), "OPENCV");
  EXPECT_EQ(ParameterCount(CameraModel::kFullOpenCv), 12);
  for (const CameraModel model : kAllModels) {
    EXPECT_EQ(CameraModelFromName(NameOf(model)), model);
    Random random(1);
    EXPECT_EQ(RandomLens(model, random).params.size(), static_cast<size_t>(ParameterCount(model)));
  }
  EXPECT_FALSE(CameraModelFromName("opencv"));
  EXPECT_THROW(ParameterCount(static_cast<CameraModel>(17)), std::invalid_argument);
  EXPECT_FALSE(CameraModelFromId(17));
  EXPECT_FALSE(CameraModelFromId(-1));
}

TEST(LensCamera, HandWorkedPixels) {
  const auto pixel = [](CameraModel model, std::vector<double> params, Eigen::Vector3d p) {
    return *LensCamera{model, 640, 480, std::move(params)}.PixelFromCam(p);
  };
  const Eigen::Vector3d p(0.6, -0.4, 2);  // x/z 0.3, y/z -0.2, r^2 0.13
  const auto expect = [](const Eigen::Vector2d& found, double x, double y) {
    EXPECT_NEAR(found.x(), x, kHandWorkedPx);
    EXPECT_NEAR(found.y(), y, kHandWorkedPx);
  };
  expect(pixel(CameraModel::kSimplePinhole, {500, 320, 240}, p), 470, 140);
  expect(pixel(CameraModel::kPinhole, {500, 400, 320, 240}, p), 470, 160);
  // Factor 1 + 0.1 * 0.13 = 1.013.
  expect(pixel(CameraModel::kSimpleRadial, {500, 320, 240, 0.1}, p), 471.95, 138.7);
  // Factor 1.013 - 0.2 * 0.0169 = 1.00962.
  expect(pixel(CameraModel::kRadial, {500, 320, 240, 0.1, -0.2}, p), 471.443, 139.038);
  // Plus 2 p1 x y + p2 (r2 + 2 x2) = -0.00012 + 0.00062 and 2 p2 x y + p1 (r2 + 2 y2)
  // = -0.00024 + 0.00021.
  expect(pixel(CameraModel::kOpenCv, {500, 400, 320, 240, 0.1, -0.2, 0.001, 0.002}, p), 471.693,
         159.2184);
  // Factor 1.00962 / (1 + 0.3 * 0.13) = 1.00962 / 1.039.
  expect(pixel(CameraModel::kFullOpenCv, {500, 400, 320, 240, 0.1, -0.2, 0, 0, 0, 0.3, 0, 0}, p),
         320 + 150 * 1.00962 / 1.039, 240 - 80 * 1.00962 / 1.039);
}

TEST(LensCamera, HandWorkedFisheyePixels) {
  // 45 degrees off the axis: angle pi/4, its square 0.6168502751.
  const Eigen::Vector3d p(3, 0, 3);
  const double angle = std::numbers::pi / 4, s = angle * angle;
  const auto x = [&](CameraModel model, std::vector<double> params) {
    return LensCamera{model, 640, 480, std::move(params)}.PixelFromCam(p)->x() - 320;
  };
  EXPECT_NEAR(x(CameraModel::kSimpleRadialFisheye, {500, 320, 240, 0.1}), 416.9227354, 1e-6);
  EXPECT_NEAR(x(CameraModel::kRadialFisheye, {500, 320, 240, 0.1, 0.2}),
              500 * angle * (1 + 0.1 * s + 0.2 * s * s), kHandWorkedPx);
  EXPECT_NEAR(x(CameraModel::kOpenCvFisheye, {500, 500, 320, 240, 0, 0, 0, 0}), 392.6990817, 1e-6);
  // The prism adds sx r^2 to x.
  EXPECT_NEAR(x(CameraModel::kThinPrismFisheye, {500, 500, 320, 240, 0, 0, 0, 0, 0, 0, 0.01, 0.5}),
              392.6990817 + 5 * s, 1e-6);
  // FOV draws r = 1 at atan(2 tan(0.5)) / 1.
  EXPECT_NEAR(x(CameraModel::kFov, {500, 500, 320, 240, 1}), 500 * std::atan(2 * std::tan(0.5)),
              kHandWorkedPx);
}

// COLMAP 4's models from their definitions (its documentation, "Camera Models"; sensor/models.h).
TEST(LensCamera, HandWorkedPixelsOfColmap4) {
  const auto pixel = [](CameraModel model, std::vector<double> params, Eigen::Vector3d p) {
    return *LensCamera{model, 640, 480, std::move(params)}.PixelFromCam(p);
  };
  const Eigen::Vector3d p(0.6, -0.4, 2);  // x/z 0.3, y/z -0.2, r^2 0.13
  // (x, y, 1) ~ (d, 1 + k |d|^2): k 0.25 and d (0.3, -0.2) c solve c = 1 + 0.25 * 0.13 c^2.
  const double c = 2 / (1 + std::sqrt(1 - 4 * 0.25 * 0.13));
  const Eigen::Vector2d division = pixel(CameraModel::kDivision, {500, 400, 320, 240, 0.25}, p);
  EXPECT_NEAR(division.x(), 320 + 150 * c, kHandWorkedPx);
  EXPECT_NEAR(division.y(), 240 - 80 * c, kHandWorkedPx);
  EXPECT_NEAR(c, 1 + 0.25 * 0.13 * c * c, 1e-15);
  EXPECT_NEAR(pixel(CameraModel::kSimpleDivision, {500, 320, 240, 0.25}, p).x(), 320 + 150 * c,
              kHandWorkedPx);
  // d = (x, y) / (alpha sqrt(beta (x^2 + y^2) + z^2) + (1 - alpha) z)
  const double den = 0.6 * std::sqrt(1.2 * 0.52 + 4) + 0.4 * 2;
  const Eigen::Vector2d eucm = pixel(CameraModel::kEucm, {500, 400, 320, 240, 0.6, 1.2}, p);
  EXPECT_NEAR(eucm.x(), 320 + 500 * 0.6 / den, kHandWorkedPx);
  EXPECT_NEAR(eucm.y(), 240 - 400 * 0.4 / den, kHandWorkedPx);
  // Equidistant: the angle in the direction of (x, y).
  const double scale = std::atan(std::sqrt(0.13)) / std::sqrt(0.13);
  EXPECT_NEAR(pixel(CameraModel::kFisheye, {500, 400, 320, 240}, p).y(), 240 - 80 * scale,
              kHandWorkedPx);
  EXPECT_NEAR(pixel(CameraModel::kSimpleFisheye, {500, 320, 240}, p).x(), 320 + 150 * scale,
              kHandWorkedPx);
  // u = angles; a = u (1 + k0 s + k1 s^2 + ... + k5 s^6); then of a, p0 at r^2 + 2 x^2 and p1 at
  // r^2 + 2 y^2, s0 r^2 + s1 r^4 in x, s2 r^2 + s3 r^4 in y.
  const Eigen::Vector2d u = Eigen::Vector2d(0.3, -0.2) * scale;
  const double s = u.squaredNorm(), k[] = {0.1, -0.2, 0.3, -0.4, 0.5, -0.6};
  double factor = 1;
  for (int i = 0; i < 6; ++i) factor += k[i] * std::pow(s, i + 1);
  const Eigen::Vector2d a = u * factor;
  const double r2 = a.squaredNorm(), p0 = 0.01, p1 = -0.02;
  const Eigen::Vector2d d(
      a.x() + 2 * p1 * a.x() * a.y() + p0 * (r2 + 2 * a.x() * a.x()) + 0.03 * r2 + 0.04 * r2 * r2,
      a.y() + 2 * p0 * a.x() * a.y() + p1 * (r2 + 2 * a.y() * a.y()) + 0.05 * r2 + 0.06 * r2 * r2);
  const Eigen::Vector2d aria = pixel(
      CameraModel::kRadTanThinPrismFisheye,
      {500, 400, 320, 240, 0.1, -0.2, 0.3, -0.4, 0.5, -0.6, p0, p1, 0.03, 0.04, 0.05, 0.06}, p);
  EXPECT_NEAR(aria.x(), 320 + 500 * d.x(), kHandWorkedPx);
  EXPECT_NEAR(aria.y(), 240 + 400 * d.y(), kHandWorkedPx);
  EXPECT_THROW((LensCamera{CameraModel::kEucm, 640, 480, {500, 500, 320, 240, 1.5, 1}}.Check()),
               std::invalid_argument);
}

TEST(LensCamera, PixelAndRayRoundTripForEveryModel) {
  for (const CameraModel model : kAllModels) {
    Random random(7 + static_cast<int>(model));
    int found = 0;
    for (int i = 0; i < kDraws; ++i) {
      const LensMap lens(RandomLens(model, random));
      for (int j = 0; j < 40; ++j) {
        const Eigen::Vector2d pixel(random.Uniform(0, 640), random.Uniform(0, 480));
        const auto ray = lens.RayFromPixel(pixel);
        if (!ray) continue;
        ++found;
        ASSERT_NEAR(ray->norm(), 1, 1e-14);
        const auto back = lens.PixelFromCam(*ray * 3.7);
        ASSERT_TRUE(back) << NameOf(model);
        ASSERT_LT((*back - pixel).norm(), kRoundTripPx) << NameOf(model);
      }
    }
    EXPECT_GT(found, 0.95 * 40 * kDraws) << NameOf(model);
  }
}

TEST(LensCamera, RayAndPixelRoundTripForEveryModel) {
  // The other way round it must also give back the ray it came from, not another one that happens
  // to be drawn at the same pixel. Rays near the model's edge are ill-conditioned: kept 10 %
  // inside.
  constexpr double kRadians = 1e-13;  // worst of all draws 9.4e-16
  for (const CameraModel model : kAllModels) {
    Random random(70 + static_cast<int>(model));
    for (int i = 0; i < kDraws; ++i) {
      const LensMap lens(RandomLens(model, random));
      for (int j = 0; j < 20; ++j) {
        const double radius = random.Uniform(0, std::min(0.9 * lens.max_radius(), 1.2));
        const double turn = random.Uniform(0, 2 * std::numbers::pi);
        const bool fisheye = NameOf(model).find("FISHEYE") != std::string::npos;
        const double angle = fisheye ? radius : std::atan(radius);
        const Eigen::Vector3d ray(std::sin(angle) * std::cos(turn),
                                  std::sin(angle) * std::sin(turn), std::cos(angle));
        const auto pixel = lens.PixelFromCam(ray);
        ASSERT_TRUE(pixel) << NameOf(model) << " radius " << radius;
        const auto back = lens.RayFromPixel(*pixel);
        ASSERT_TRUE(back) << NameOf(model) << " radius " << radius;
        ASSERT_LT((*back - ray).norm(), kRadians) << NameOf(model) << " radius " << radius;
      }
    }
  }
}

// OpenCV's pixel centres are integers, ours are i + 0.5: its principal point is ours less 0.5.
cv::Matx33d OpenCvMatrix(const LensCamera& camera) {
  const PinholeCamera k = camera.Pinhole();
  return {k.fx_px(), 0, k.cx_px() - 0.5, 0, k.fy_px(), k.cy_px() - 0.5, 0, 0, 1};
}

std::vector<cv::Point3d> RandomPoints(Random& random) {
  std::vector<cv::Point3d> points;
  for (int i = 0; i < 50; ++i) {
    points.emplace_back(random.Uniform(-0.5, 0.5), random.Uniform(-0.4, 0.4),
                        random.Uniform(0.9, 1.1));
  }
  return points;
}

void ExpectSamePixels(const LensCamera& camera, const std::vector<cv::Point3d>& points,
                      const std::vector<cv::Point2d>& expected) {
  for (size_t i = 0; i < points.size(); ++i) {
    const auto pixel = camera.PixelFromCam({points[i].x, points[i].y, points[i].z});
    ASSERT_TRUE(pixel);
    ASSERT_NEAR(pixel->x() - 0.5, expected[i].x, kOpenCvPx) << NameOf(camera.model);
    ASSERT_NEAR(pixel->y() - 0.5, expected[i].y, kOpenCvPx) << NameOf(camera.model);
  }
}

TEST(LensCamera, PerspectiveModelsAgreeWithOpenCv) {
  Random random(11);
  for (const CameraModel model :
       {CameraModel::kPinhole, CameraModel::kSimpleRadial, CameraModel::kRadial,
        CameraModel::kOpenCv, CameraModel::kFullOpenCv}) {
    for (int i = 0; i < kDraws; ++i) {
      const LensCamera camera = RandomLens(model, random);
      const auto& p = camera.params;
      std::vector<double> coefficients(8, 0.0);  // k1, k2, p1, p2, k3, k4, k5, k6
      if (model == CameraModel::kSimpleRadial) coefficients[0] = p[3];
      if (model == CameraModel::kRadial) std::copy(p.begin() + 3, p.end(), coefficients.begin());
      if (p.size() >= 8) std::copy(p.begin() + 4, p.end(), coefficients.begin());
      const auto points = RandomPoints(random);
      std::vector<cv::Point2d> expected;
      const cv::Vec3d zero(0, 0, 0);
      cv::projectPoints(points, zero, zero, OpenCvMatrix(camera), coefficients, expected);
      ExpectSamePixels(camera, points, expected);
    }
  }
}

TEST(LensCamera, FisheyeModelsAgreeWithOpenCv) {
  Random random(12);
  for (const CameraModel model : {CameraModel::kOpenCvFisheye, CameraModel::kSimpleRadialFisheye,
                                  CameraModel::kRadialFisheye}) {
    for (int i = 0; i < kDraws; ++i) {
      const LensCamera camera = RandomLens(model, random);
      const auto& p = camera.params;
      cv::Vec4d coefficients(0, 0, 0, 0);
      const size_t first = model == CameraModel::kOpenCvFisheye ? 4 : 3;
      for (size_t k = first; k < p.size(); ++k) coefficients[static_cast<int>(k - first)] = p[k];
      const auto points = RandomPoints(random);
      std::vector<cv::Point2d> expected;
      const cv::Vec3d zero(0, 0, 0);
      cv::fisheye::projectPoints(points, expected, zero, zero, OpenCvMatrix(camera), coefficients);
      ExpectSamePixels(camera, points, expected);
    }
  }
}

TEST(LensCamera, PointsBehindTheCameraAndNoNumbersHaveNoPixel) {
  for (const CameraModel model : kAllModels) {
    Random random(13);
    const LensCamera camera = RandomLens(model, random);
    EXPECT_FALSE(camera.PixelFromCam({0, 0, -1})) << NameOf(model);
    EXPECT_FALSE(camera.PixelFromCam({0, 0, 0})) << NameOf(model);
    EXPECT_FALSE(camera.PixelFromCam({std::numeric_limits<double>::quiet_NaN(), 0, 1}));
    EXPECT_FALSE(camera.RayFromPixel({std::numeric_limits<double>::infinity(), 0}));
  }
  EXPECT_FALSE((LensCamera{CameraModel::kPinhole, 640, 480, {500, 500, 320, 240}}.PixelFromCam(
      {0.1, 0.1, -1})));
}

TEST(LensCamera, NothingIsSeenBeyondTheRadiusWhereDistortionTurnsBack) {
  // r (1 - 0.3 r^2) grows until 1 = 0.9 r^2: r = 1.0540925534, drawn at 0.7027283689.
  const LensCamera camera{CameraModel::kSimpleRadial, 640, 480, {500, 320, 240, -0.3}};
  EXPECT_NEAR(LensMap(camera).max_radius(), 1.0540925534, 1e-9);
  EXPECT_TRUE(camera.PixelFromCam({1.05, 0, 1}));
  EXPECT_FALSE(camera.PixelFromCam({1.06, 0, 1}));
  EXPECT_FALSE(camera.PixelFromCam({0, 5, 1}));  // without the guard: drawn at -32.5 f
  EXPECT_TRUE(camera.RayFromPixel({320 + 500 * 0.702, 240}));
  EXPECT_FALSE(camera.RayFromPixel({320 + 500 * 0.703, 240}));
}

TEST(LensCamera, RationalModelEndsAtItsPole) {
  // r / (1 - 0.25 r^2) rises to infinity at r = 2 and is negative beyond.
  const LensCamera camera{
      CameraModel::kFullOpenCv, 640, 480, {500, 500, 320, 240, 0, 0, 0, 0, 0, -0.25, 0, 0}};
  EXPECT_NEAR(LensMap(camera).max_radius(), 2, 1e-12);
  EXPECT_FALSE(camera.PixelFromCam({2.5, 0, 1}));
  const auto far_pixel = camera.PixelFromCam({1.99, 0, 1});
  ASSERT_TRUE(far_pixel);
  EXPECT_NEAR(camera.RayFromPixel(*far_pixel)->x() / camera.RayFromPixel(*far_pixel)->z(), 1.99,
              1e-9);
}

TEST(LensCamera, FisheyeSeesBeyondNinetyDegrees) {
  const LensCamera camera{CameraModel::kOpenCvFisheye, 640, 480, {200, 200, 320, 240, 0, 0, 0, 0}};
  for (const double degrees : {1e-7, 1.0, 89.0, 90.0, 91.0, 120.0, 179.0}) {
    const double angle = degrees * std::numbers::pi / 180;
    const Eigen::Vector3d ray(std::sin(angle) * 0.6, std::sin(angle) * 0.8, std::cos(angle));
    const auto pixel = camera.PixelFromCam(ray);
    ASSERT_TRUE(pixel) << degrees;
    EXPECT_NEAR((*pixel - Eigen::Vector2d(320, 240)).norm(), 200 * angle, 1e-9) << degrees;
    EXPECT_LT((*camera.RayFromPixel(*pixel) - ray).norm(), 1e-12) << degrees;
  }
  EXPECT_FALSE(camera.RayFromPixel({320 + 200 * 3.2, 240}));  // an angle beyond 180 degrees
}

TEST(LensCamera, FovOfATinyAngleIsThePinholeCamera) {
  for (const double omega : {0.0, 1e-12, 1e-7}) {
    const LensCamera camera{CameraModel::kFov, 640, 480, {500, 500, 320, 240, omega}};
    EXPECT_EQ(camera.IsUndistorted(), omega == 0);
    EXPECT_NEAR(camera.PixelFromCam({1, 1, 2})->x(), 570, 1e-9);
    EXPECT_NEAR(camera.RayFromPixel({570, 240})->x(), std::sqrt(0.2), 1e-12);
  }
  const LensCamera impossible{CameraModel::kFov, 640, 480, {500, 500, 320, 240, 3.5}};
  EXPECT_FALSE(impossible.PixelFromCam({1, 1, 2}));
  EXPECT_FALSE(impossible.RayFromPixel({321, 240}));
}

TEST(LensCamera, OnlyPerspectiveModelsWithZeroCoefficientsAreUndistorted) {
  EXPECT_TRUE((LensCamera{CameraModel::kPinhole, 4, 4, {5, 5, 2, 2}}.IsUndistorted()));
  EXPECT_TRUE((LensCamera{CameraModel::kOpenCv, 4, 4, {5, 5, 2, 2, 0, 0, 0, 0}}.IsUndistorted()));
  EXPECT_FALSE(
      (LensCamera{CameraModel::kOpenCv, 4, 4, {5, 5, 2, 2, 0, 0, 0, 1e-9}}.IsUndistorted()));
  EXPECT_FALSE((LensCamera{CameraModel::kSimpleRadialFisheye, 4, 4, {5, 2, 2, 0}}.IsUndistorted()));
}

TEST(LensCamera, PinholeKeepsSizeFocalLengthsAndPrincipalPoint) {
  const LensCamera two{CameraModel::kOpenCv, 640, 480, {500, 510, 321, 239, 0.1, 0, 0, 0}};
  EXPECT_EQ(two.Pinhole(), PinholeCamera(640, 480, 500, 510, 321, 239));
  const LensCamera one{CameraModel::kRadial, 640, 480, {500, 321, 239, 0.1, 0}};
  EXPECT_EQ(one.Pinhole(), PinholeCamera(640, 480, 500, 500, 321, 239));
}

TEST(LensCamera, RejectsImpossibleParameters) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto check = [](CameraModel model, int width, std::vector<double> params) {
    LensCamera{model, width, 480, std::move(params)}.Check();
  };
  EXPECT_NO_THROW(check(CameraModel::kPinhole, 640, {500, 500, 320, 240}));
  EXPECT_THROW(check(CameraModel::kPinhole, 0, {500, 500, 320, 240}), std::invalid_argument);
  EXPECT_THROW(check(CameraModel::kPinhole, 640, {500, 500, 320}), std::invalid_argument);
  EXPECT_THROW(check(CameraModel::kPinhole, 640, {500, 0, 320, 240}), std::invalid_argument);
  EXPECT_THROW(check(CameraModel::kPinhole, 640, {500, 500, nan, 240}), std::invalid_argument);
  EXPECT_THROW(check(static_cast<CameraModel>(99), 640, {500, 500, 320, 240}),
               std::invalid_argument);
}

}  // namespace
}  // namespace dtr::calib
