// Files of other programs in the ways in which programs write them: which it is shows by their
// points. Whatever the way, every point must be where the model that was written puts it.
#include "pipeline/core/cameras/point_conventions.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "calib/lens_map.h"
#include "dtr/base/files.h"
#include "dtr/base/random.h"
#include "dtr/base/temporary_folder.h"
#include "dtr/io/formats/foreign_readers.h"
#include "pipeline/core/cameras/camera_distortion.h"
#include "pipeline/core/cameras/foreign_cameras.h"
#include "tests/pipeline/source_programs.h"

namespace dtr::pipeline {
namespace {

using dtr::testing::TrueCamera;
using dtr::testing::TrueCapture;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kW = TrueCapture::kWidth, kH = TrueCapture::kHeight, kFocal = 500;
constexpr double kSamePx = 1e-6;  // files have full doubles
// Formulas of distortion that differ by less say the same: which is meant no feature shows.
constexpr double kFormulasPx = 0.1;

// Pixel from the corner, y down, of a point in the camera.
using Project = std::function<Vector2d(const Vector3d&)>;

Project Projected(double k1, double cx = kW / 2, double cy = kH / 2, double k2 = 0) {
  return [=](const Vector3d& p) {
    const Vector2d n(p.x() / p.z(), p.y() / p.z());
    const double r2 = n.squaredNorm();
    return Vector2d(kFocal * (1 + k1 * r2 + k2 * r2 * r2) * n + Vector2d(cx, cy));
  };
}

// VisualSFM's: the measured point m has m (1 + r |m|^2) = p.
Project Measured(double r) {
  return [=](const Vector3d& p) {
    const double projected = std::hypot(p.x(), p.y()) / p.z();
    double m = projected;
    for (int i = 0; i < 100; ++i) m = projected / (1 + r * m * m);
    const double scale = projected > 0 ? m / projected : 1;
    return Vector2d(kFocal * scale * Vector2d(p.x(), p.y()) / p.z() + Vector2d(kW, kH) / 2);
  };
}

// What a program writes for a pixel.
using Written = std::function<Vector2d(const Vector2d&)>;
Vector2d FromCorner(const Vector2d& p) { return p; }
Vector2d FromMiddle(const Vector2d& p) { return p - Vector2d(kW, kH) / 2; }
Vector2d FromMiddleYUp(const Vector2d& p) { return {p.x() - kW / 2, kH / 2 - p.y()}; }
Vector2d FromLowerCorner(const Vector2d& p) { return {p.x(), kH - p.y()}; }

class PointConventions : public ::testing::Test {
 protected:
  // An .nvm whose cameras have the distortion r and are turned by `axes`.
  PlacedCameras Nvm(const std::string& head, double r, const Project& project,
                    const Written& written, const Vector3d& axes = {1, 1, 1}) {
    std::string text = fmt::format("NVM_V3 {}\n \n{}\n", head, capture_.cameras.size());
    for (const TrueCamera& c : capture_.cameras) {
      const Eigen::Quaterniond q(Matrix3d(axes.asDiagonal() * c.rotation));
      text += fmt::format("{} {} {} {} {} {} {} {} {} {} 0\n", c.name, kFocal, q.w(), q.x(), q.y(),
                          q.z(), c.centre.x(), c.centre.y(), c.centre.z(), r);
    }
    text += fmt::format("\n{}\n", capture_.points.size());
    for (const Vector3d& p : capture_.points) {
      text += fmt::format("{} {} {} 10 20 30 {}", p.x(), p.y(), p.z(), capture_.cameras.size());
      for (size_t i = 0; i < capture_.cameras.size(); ++i) {
        const Vector2d pixel = written(Noisy(project(capture_.cameras[i].InCamera(p))));
        text += fmt::format(" {} 3 {} {}", i, pixel.x(), pixel.y());
      }
      text += "\n";
    }
    WriteFileAtomically(File(), text);
    return Placed(io::ReadNvm(File()));
  }

  // A bundle.out likewise; a camera of Bundler looks along -z with y up.
  PlacedCameras Bundler(double k1, double k2, const Project& project, const Written& written,
                        const Vector3d& axes = {1, -1, -1}) {
    std::string text =
        fmt::format("# Bundle file v0.3\n{} {}\n", capture_.cameras.size(), capture_.points.size());
    std::string list;
    for (const TrueCamera& c : capture_.cameras) {
      const Matrix3d r = axes.asDiagonal() * c.rotation;
      const Vector3d t = -r * c.centre;
      text += fmt::format("{} {} {}\n", kFocal, k1, k2);
      for (int i = 0; i < 3; ++i) text += fmt::format("{} {} {}\n", r(i, 0), r(i, 1), r(i, 2));
      text += fmt::format("{} {} {}\n", t.x(), t.y(), t.z());
      list += c.name + "\n";
    }
    for (const Vector3d& p : capture_.points) {
      text += fmt::format("{} {} {}\n10 20 30\n{}", p.x(), p.y(), p.z(), capture_.cameras.size());
      for (size_t i = 0; i < capture_.cameras.size(); ++i) {
        const Vector2d pixel = written(Noisy(project(capture_.cameras[i].InCamera(p))));
        text += fmt::format(" {} 3 {} {}", i, pixel.x(), pixel.y());
      }
      text += "\n";
    }
    // As COLMAP calls the two files.
    const auto file = folder_.path() / "scene.bundle.out";
    WriteFileAtomically(file, text);
    WriteFileAtomically(folder_.path() / "scene.list.txt", list);
    return Placed(io::ReadBundlerOut(file));
  }

  // Every camera sees every point where the model puts it, and the points' pixels say the same.
  void ExpectTrue(const PlacedCameras& placed, const Project& project,
                  double same_px = kSamePx) const {
    ASSERT_EQ(placed.list.cameras.size(), capture_.cameras.size());
    for (size_t i = 0; i < capture_.cameras.size(); ++i) {
      const io::NamedCamera& named = placed.list.cameras[i];
      const calib::LensMap lens(CameraModelOf(named));
      for (const Vector3d& p : capture_.points) {
        const auto pixel = lens.PixelFromCam(named.cam_from_world * p);
        ASSERT_TRUE(pixel);
        ASSERT_LT((*pixel - project(capture_.cameras[i].InCamera(p))).norm(), same_px);
      }
    }
    ASSERT_TRUE(placed.model);
    for (const calib::SfmImage& image : placed.model->images) {
      const calib::LensMap lens(placed.model->cameras.at(image.camera_id));
      for (const calib::SfmFeature& feature : image.features) {
        const auto pixel = lens.PixelFromCam(image.cam_from_world *
                                             placed.model->points.at(feature.point_id).p_in_world);
        ASSERT_TRUE(pixel);
        ASSERT_LT((*pixel - feature.pixel).norm(), same_px);
      }
    }
  }

  std::filesystem::path File() const { return folder_.path() / "scene.nvm"; }

  TrueCapture capture_;
  double noise_px_ = 0;

 private:
  Vector2d Noisy(const Vector2d& pixel) {
    return pixel + noise_px_ * Vector2d(random_.Normal(), random_.Normal());
  }
  PlacedCameras Placed(io::ForeignScene scene) {
    std::vector<std::string> names;
    for (const TrueCamera& camera : capture_.cameras) names.push_back(camera.name);
    return PlaceCameras(std::move(scene), "scene.nvm", PhotoNames(names),
                        [](const std::string& name) {
                          return io::SizedImage{name, TrueCapture::kWidth, TrueCapture::kHeight};
                        });
  }

  TemporaryFolder folder_;
  Random random_{7};
};

TEST_F(PointConventions, VisualSfmsOwnWaysAreNotSpokenOf) {
  for (const double r : {0.0, 0.15, -0.1}) {
    const PlacedCameras placed = Nvm("", r, Measured(r), FromMiddle);
    ExpectTrue(placed, Measured(r));
    EXPECT_THAT(placed.notes, IsEmpty());
  }
}

TEST_F(PointConventions, ColmapsNvmIsRead) {
  for (const double k1 : {0.0, -0.11, 0.08}) {
    const PlacedCameras placed = Nvm("", -k1, Projected(k1), FromCorner);
    ExpectTrue(placed, Projected(k1));
    EXPECT_THAT(placed.notes, ElementsAre(AllOf(HasSubstr("pixels from the image's corner"),
                                                HasSubstr("as COLMAP writes it"))));
  }
}

TEST_F(PointConventions, PrincipalPointsShowInPixelsFromTheCorner) {
  const Project project = Projected(-0.1, 331, 229.5);
  const PlacedCameras placed = Nvm("", 0.1, project, FromCorner);
  ExpectTrue(placed, project);
  EXPECT_THAT(placed.notes, ElementsAre(HasSubstr("principal points as these pixels have them")));
}

TEST_F(PointConventions, SignsAndUnitsOfDistortionShow) {
  const struct {
    double r;
    Project project;
    const char* says;
  } cases[] = {{0.3, Measured(-0.3), "measured point with the sign changed"},
               {-0.3, Projected(-0.3), "distortion of the projected point;"},
               {0.4, Projected(-0.4), "projected point with the sign changed;"},
               {0.12 / kFocal / kFocal, Measured(0.12), "per pixel instead of per focal length"}};
  for (const auto& [r, project, says] : cases) {
    const PlacedCameras placed = Nvm("", r, project, FromMiddle);
    ExpectTrue(placed, project);
    EXPECT_THAT(placed.notes, ElementsAre(HasSubstr(says)));
  }
}

TEST_F(PointConventions, DirectionsOfYAndOfTheCamerasShow) {
  for (const Written written : {FromMiddle, FromMiddleYUp, FromCorner, FromLowerCorner}) {
    for (const Vector3d& axes : {Vector3d(1, 1, 1), Vector3d(1, -1, -1)}) {
      ExpectTrue(Nvm("", 0.03, Measured(0.03), written, axes), Measured(0.03), kFormulasPx);
      ExpectTrue(Bundler(-0.1, 0.03, Projected(-0.1, kW / 2, kH / 2, 0.03), written, axes),
                 Projected(-0.1, kW / 2, kH / 2, 0.03), kFormulasPx);
    }
  }
}

TEST_F(PointConventions, BundlersOwnWayAndColmapsAreTheSame) {
  const Project project = Projected(-0.1, kW / 2, kH / 2, 0.03);
  const PlacedCameras placed = Bundler(-0.1, 0.03, project, FromMiddleYUp);
  ExpectTrue(placed, project);
  EXPECT_THAT(placed.notes, IsEmpty());
  const PlacedCameras negated = Bundler(0.1, -0.03, project, FromMiddleYUp);
  ExpectTrue(negated, project);
  EXPECT_THAT(negated.notes, ElementsAre(HasSubstr("with the sign changed")));
}

TEST_F(PointConventions, FixedKCountsFromWhereItsPixelsDo) {
  const Project project = Projected(0, 324, 236);
  const char kFixed[] = "FixedK 500 324 500 236";
  for (const Written& written :
       {Written(FromCorner), Written(FromMiddle),
        Written([](const Vector2d& p) { return Vector2d(p - Vector2d(324, 236)); })}) {
    ExpectTrue(Nvm(kFixed, 0, project, written), project);
  }
}

// What noise hides is not looked for, what it does not is found.
TEST_F(PointConventions, NoiseDecidesNothing) {
  noise_px_ = 0.8;
  EXPECT_THAT(Nvm("", 0.1, Measured(0.1), FromMiddle).notes, IsEmpty());
  EXPECT_THAT(Bundler(-0.1, 0, Projected(-0.1), FromMiddleYUp).notes, IsEmpty());
  EXPECT_THAT(Nvm("", 0, Measured(0), FromMiddle).notes, IsEmpty());
  EXPECT_THAT(Nvm("", 0.1, Projected(-0.1), FromCorner).notes,
              ElementsAre(HasSubstr("as COLMAP writes it")));
}

// Cameras that fit their points in no way are for the photos to test.
TEST_F(PointConventions, WhatNoWayExplainsStaysAsItIs) {
  for (TrueCamera& camera : capture_.cameras) camera.centre.x() += 0.3 * camera.centre.y();
  const Project project = Measured(0.1);
  const TrueCapture truth;
  size_t camera = 0;
  const Written elsewhere = [&](const Vector2d&) {
    const Vector3d p = truth.points[camera / truth.cameras.size()];
    return FromMiddle(project(truth.cameras[camera++ % truth.cameras.size()].InCamera(p)));
  };
  const PlacedCameras placed = Nvm("", 0.1, project, elsewhere);
  EXPECT_THAT(placed.notes, IsEmpty());
}

TEST_F(PointConventions, TwoMeasurementsDecideNothing) {
  capture_.points.resize(1);
  capture_.cameras.resize(2);
  EXPECT_THAT(Nvm("", 0.1, Projected(-0.1), FromCorner).notes, IsEmpty());
}

}  // namespace
}  // namespace dtr::pipeline
