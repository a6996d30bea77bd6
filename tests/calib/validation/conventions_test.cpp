#include "calib/validation/conventions.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>

#include "datasets/exact/bundle.h"

namespace dtr::calib {
namespace {

using Cameras = std::vector<GivenCamera>;
using ::testing::HasSubstr;
namespace bundle = dtr::testing::bundle;

const LensCamera kBrown{
    CameraModel::kOpenCv, 1000, 800, {900, 905, 504, 397, -0.12, 0.03, 0.004, -0.003}};
const LensCamera kIdeal{CameraModel::kPinhole, 1000, 800, {900, 905, 504, 397}};

// Photos from all around at several heights and rolls, as a person takes them.
Pose Around(int i, int n) {
  const double angle = 2 * M_PI * i / n;
  const Pose pose = bundle::LookAt({6 * std::sin(angle), -6 * std::cos(angle), 0.7 + 0.9 * (i % 3)},
                                   {0.3 * (i % 2), 0.2, 0.1 * (i % 4)});
  const Eigen::Quaterniond roll(
      Eigen::AngleAxisd(0.3 * ((i * 7) % 5 - 2), Eigen::Vector3d::UnitZ()));
  return Pose{roll, Eigen::Vector3d::Zero()} * pose;
}

// A walk that looks aside: nearly parallel cameras.
Pose Walk(int i, int n) {
  const double x = 4.0 * i / (n - 1) - 2;
  return bundle::LookAt({x, -6, 0.05 * (i % 3)}, {x + 0.1 * (i % 2), 0, 0});
}

struct Scene {
  Cameras cameras;
  std::vector<MatchedPair> pairs;
};

Scene SceneOf(const LensCamera& lens, double noise_px, std::uint64_t seed,
              const std::function<Pose(int, int)>& pose = Around, int images = 12) {
  const Bundle made = bundle::MakeBundle({.images = images,
                                          .points = 300,
                                          .lens = lens,
                                          .noise_px = noise_px,
                                          .seed = seed,
                                          .pose = pose});
  Scene scene;
  for (int i = 0; i < images; ++i) {
    // "1.jpg" ... "12.jpg", in the order of letters, which is that of GivenCamera lists.
    scene.cameras.push_back(
        {fmt::format("{}.jpg", i + 1), lens, made.images[static_cast<size_t>(i)].cam_from_world});
  }
  std::vector<int> order(static_cast<size_t>(images));
  for (int i = 0; i < images; ++i) order[static_cast<size_t>(i)] = i;
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return scene.cameras[static_cast<size_t>(a)].name < scene.cameras[static_cast<size_t>(b)].name;
  });
  std::map<int, int> at;
  Cameras sorted;
  for (const int i : order) {
    at[i] = static_cast<int>(sorted.size());
    sorted.push_back(scene.cameras[static_cast<size_t>(i)]);
  }
  scene.cameras = std::move(sorted);
  std::map<std::pair<int, int>, MatchedPair> pairs;
  const auto& observations = made.observations;
  for (size_t i = 0; i < observations.size(); ++i) {
    for (size_t j = i + 1;
         j < observations.size() && observations[j].point == observations[i].point; ++j) {
      MatchedPair& pair = pairs[{at[observations[i].image], at[observations[j].image]}];
      pair.a = at[observations[i].image];
      pair.b = at[observations[j].image];
      pair.pixels.emplace_back(observations[i].pixel, observations[j].pixel);
    }
  }
  for (auto& [key, pair] : pairs) scene.pairs.push_back(std::move(pair));
  return scene;
}

// The cameras as a file with a mistake has them.
ConventionReport With(const Scene& scene, const std::function<void(GivenCamera&)>& fault) {
  Cameras given = scene.cameras;
  for (GivenCamera& camera : given) fault(camera);
  return TestConventions(given, scene.pairs);
}

void ExpectFound(const ConventionReport& report, const std::string& name) {
  ASSERT_FALSE(report.found.empty()) << name << ": " << report.given_px << " px";
  EXPECT_THAT(report.found.front().name, HasSubstr(name));
  EXPECT_EQ(report.found.size(), 1u) << report.found.back().name;
  EXPECT_LT(report.found.back().residual_px, 0.3);  // noise of 0.2 px per coordinate
  EXPECT_GT(report.given_px, report.found.back().residual_px);
  EXPECT_FALSE(report.fits());
  EXPECT_THAT(LineOf(report, "cams.json"), HasSubstr(name));
}

Pose Turned(const Eigen::Vector3d& diagonal, const Pose& pose) {
  return Pose{Eigen::Quaterniond(Eigen::Matrix3d(diagonal.asDiagonal())), {0, 0, 0}} * pose;
}

constexpr double kNoisePx = 0.2;

TEST(Conventions, RightCamerasFitAtEveryNoise) {
  for (const double noise_px : {0.0, 0.3, 1.0, 2.0}) {
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      for (const LensCamera& lens : {kBrown, kIdeal}) {
        for (const auto& pose : {&Around, &Walk}) {
          const Scene scene = SceneOf(lens, noise_px, seed, *pose);
          const ConventionReport report = TestConventions(scene.cameras, scene.pairs);
          EXPECT_TRUE(report.tested());
          EXPECT_TRUE(report.found.empty())
              << report.found.front().name << " at " << noise_px << " px";
          EXPECT_TRUE(report.fits()) << report.given_px;
          EXPECT_EQ(LineOf(report, "cams.json"), "");
        }
      }
    }
  }
}

TEST(Conventions, AxesOfOtherProgramsAreNamed) {
  const Scene scene = SceneOf(kBrown, kNoisePx, 5);
  ExpectFound(With(scene,
                   [](GivenCamera& c) {
                     c.cam_from_world = Turned({1, -1, -1}, c.cam_from_world);
                   }),
              "OpenGL's axes");
  ExpectFound(With(scene,
                   [](GivenCamera& c) {
                     c.cam_from_world = Turned({-1, -1, 1}, c.cam_from_world);
                   }),
              "PyTorch3D's axes");
  ExpectFound(With(scene,
                   [](GivenCamera& c) {
                     Eigen::Matrix3d llff_from_cam;
                     llff_from_cam << 0, 1, 0, 1, 0, 0, 0, 0, -1;
                     c.cam_from_world =
                         Pose{Eigen::Quaterniond(llff_from_cam), {0, 0, 0}} * c.cam_from_world;
                   }),
              "LLFF's axes");
}

TEST(Conventions, InvertedMatricesAreNamedWithTheirAxes) {
  const Scene scene = SceneOf(kIdeal, kNoisePx, 6);
  ExpectFound(With(scene, [](GivenCamera& c) { c.cam_from_world = c.cam_from_world.Inverse(); }),
              "camera-to-world matrices");
  // transforms.json taken for cameras.json.
  ExpectFound(With(scene,
                   [](GivenCamera& c) {
                     c.cam_from_world = Turned({1, -1, -1}, c.cam_from_world).Inverse();
                   }),
              "camera-to-world matrices with OpenGL's axes");
}

TEST(Conventions, TheHalfPixelIsNamedInEitherDirection) {
  const Scene scene = SceneOf(kIdeal, 0.1, 7);
  const auto shifted = [&](double px) {
    return With(scene, [&](GivenCamera& c) {
      c.lens.params[2] += px;
      c.lens.params[3] += px;
    });
  };
  ExpectFound(shifted(-0.5), "half a pixel larger");
  ExpectFound(shifted(0.5), "half a pixel smaller");
}

TEST(Conventions, MistakesWithDistortionAreNamed) {
  const Scene scene = SceneOf(kBrown, kNoisePx, 8);
  ExpectFound(With(scene, [](GivenCamera& c) { std::swap(c.lens.params[6], c.lens.params[7]); }),
              "p1 and p2 swapped");
  ExpectFound(With(scene, [](GivenCamera& c) { c.lens.model = CameraModel::kOpenCvFisheye; }),
              "perspective model");
  ExpectFound(With(scene,
                   [](GivenCamera& c) {
                     for (size_t i = 4; i < 8; ++i) c.lens.params[i] = -c.lens.params[i];
                   }),
              "other sign");
  const Scene undistorted = SceneOf(kIdeal, kNoisePx, 8);
  ExpectFound(With(undistorted, [](GivenCamera& c) { c.lens = kBrown; }), "no distortion");
  LensCamera radial = kBrown;
  radial.params = {900, 905, 504, 397, -0.12, 0, 0, 0};
  const Scene distorted = SceneOf(radial, kNoisePx, 8);
  const ConventionReport ignored = With(distorted, [](GivenCamera& c) { c.lens = kIdeal; });
  ExpectFound(ignored, "distorted photos");
  EXPECT_THAT(ignored.found.front().advice, HasSubstr("k1 near -0.12"));
}

TEST(Conventions, IntrinsicsOfAnotherSizeAreNamed) {
  const Scene scene = SceneOf(kIdeal, kNoisePx, 9);
  const ConventionReport report = With(scene, [](GivenCamera& c) {
    for (double& value : c.lens.params) value *= 2.5;
  });
  ASSERT_FALSE(report.found.empty());
  EXPECT_THAT(report.found.front().name, HasSubstr("intrinsics of an image of 2.5"));
  const ConventionReport half = With(scene, [](GivenCamera& c) {
    for (double& value : c.lens.params) value *= 0.5;
  });
  ASSERT_FALSE(half.found.empty());
  EXPECT_THAT(half.found.front().name, HasSubstr("intrinsics of an image of 0.5"));
}

TEST(Conventions, PhotosInAnotherOrderAreNamed) {
  const Scene scene = SceneOf(kIdeal, kNoisePx, 10);
  const size_t n = scene.cameras.size();
  const auto reordered = [&](const std::function<size_t(size_t)>& from) {
    Cameras given = scene.cameras;
    for (size_t i = 0; i < n; ++i) given[i].cam_from_world = scene.cameras[from(i)].cam_from_world;
    return TestConventions(given, scene.pairs);
  };
  ExpectFound(reordered([&](size_t i) { return n - 1 - i; }), "reversed");
  ExpectFound(reordered([&](size_t i) { return (i + 1) % n; }), "another order");
  // The file's cameras in the order 1, 2, 3, ..., paired with photos in the order 1, 10, 11, 12, 2.
  const auto number = [&](size_t i) { return std::stoi(scene.cameras[i].name); };
  const ConventionReport by_number = reordered([&](size_t i) {
    for (size_t k = 0; k < n; ++k) {
      if (number(k) == static_cast<int>(i) + 1) return k;
    }
    return n;
  });
  ExpectFound(by_number, "1, 10, 2");
}

TEST(Conventions, TwoMistakesAreNamedOneOnTopOfTheOther) {
  const Scene scene = SceneOf(kBrown, kNoisePx, 11);
  const ConventionReport report = With(scene, [](GivenCamera& c) {
    c.cam_from_world = Turned({1, -1, -1}, c.cam_from_world);
    std::swap(c.lens.params[6], c.lens.params[7]);
  });
  ASSERT_EQ(report.found.size(), 2u);
  EXPECT_THAT(report.found[0].name, HasSubstr("OpenGL"));
  EXPECT_THAT(report.found[1].name, HasSubstr("p1 and p2"));
}

TEST(Conventions, CamerasOfOtherPhotosAreExplainedByNothing) {
  const Scene scene = SceneOf(kIdeal, kNoisePx, 12);
  Random random(4);
  const ConventionReport report = With(scene, [&](GivenCamera& c) {
    c.cam_from_world.rotation =
        Eigen::Quaterniond(random.Normal(), random.Normal(), random.Normal(), random.Normal())
            .normalized();
  });
  EXPECT_TRUE(report.found.empty()) << report.found.front().name;
  EXPECT_FALSE(report.fits());
  EXPECT_THAT(LineOf(report, "cams.json"), HasSubstr("no usual mistake explains it"));
}

TEST(Conventions, FewMatchesSayNothing) {
  Scene scene = SceneOf(kIdeal, kNoisePx, 13);
  scene.pairs.resize(1);
  scene.pairs.front().pixels.resize(20);
  const ConventionReport report =
      With(scene, [](GivenCamera& c) { c.cam_from_world = c.cam_from_world.Inverse(); });
  EXPECT_FALSE(report.tested());
  EXPECT_FALSE(report.fits());
  EXPECT_EQ(LineOf(report, "cams.json"), "");
}

}  // namespace
}  // namespace dtr::calib
