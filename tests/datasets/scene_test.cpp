#include "datasets/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "datasets/layout.h"
#include "dtr/base/error.h"
#include "dtr/base/random.h"

namespace dtr::datasets {
namespace {

using Eigen::Vector3d;

// Double rounding, amplified by the conditioning of a quadratic root.
constexpr double kExact = 1e-12;
// Towards its silhouette the depth of a sphere is ill-conditioned as a number, whoever computes it:
// the closed form is compared where the ray's discriminant keeps this share of the radius squared.
constexpr double kAwayFromSilhouette = 1e-2;

Vector3d RandomDirection(Random& random) {
  return Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
}

Primitive RandomPrimitive(Primitive::Shape shape, Random& random) {
  Primitive p;
  p.shape = shape;
  p.local_from_world =
      Eigen::Quaterniond(random.Normal(), random.Normal(), random.Normal(), random.Normal())
          .normalized()
          .toRotationMatrix();
  p.center = Vector3d(random.Normal(), random.Normal(), random.Normal());
  p.half = Vector3d(random.Uniform(0.1, 2), random.Uniform(0.1, 2), random.Uniform(0.1, 2));
  p.apex = Eigen::Vector2d(random.Uniform(-1, 2), random.Uniform(0.2, 2));
  return p;
}

/// Signed measure of how far a local point is from the surface of the shape.
double SurfaceError(const Primitive& p, const Vector3d& local) {
  switch (p.shape) {
    case Primitive::Shape::kRectangle:
    case Primitive::Shape::kTriangle:
      return std::abs(local.z());
    case Primitive::Shape::kBox:
      return std::abs((local.cwiseAbs() - p.half).maxCoeff());
    case Primitive::Shape::kSphere:
      return std::abs(local.norm() - p.half.x());
    case Primitive::Shape::kCylinder:
      return std::abs(
          std::max(local.head<2>().norm() - p.half.x(), std::abs(local.z()) - p.half.z()));
  }
  return kNoHit;
}

TEST(Primitive, HitsLieOnTheSurfaceInsideItsBoundsAndFaceOutwards) {
  Random random(1);
  for (const auto shape :
       {Primitive::Shape::kRectangle, Primitive::Shape::kTriangle, Primitive::Shape::kBox,
        Primitive::Shape::kSphere, Primitive::Shape::kCylinder}) {
    int hits = 0;
    for (int i = 0; i < 20000; ++i) {
      const Primitive p = RandomPrimitive(shape, random);
      const Vector3d from = 5 * RandomDirection(random);
      const Ray ray{from, p.center + RandomDirection(random) - from};
      const double t = p.Intersect(ray, 0, kNoHit);
      if (t == kNoHit) continue;
      ++hits;
      const Vector3d point = ray.At(t);
      ASSERT_LT(SurfaceError(p, p.ToLocal(point)), kExact * 10);
      Eigen::AlignedBox3d box = p.Bounds();
      box.min().array() -= kExact * 10;
      box.max().array() += kExact * 10;
      ASSERT_TRUE(box.contains(point));
      ASSERT_NEAR(p.NormalAt(point).norm(), 1, kExact);
      const bool closed =
          shape != Primitive::Shape::kRectangle && shape != Primitive::Shape::kTriangle;
      const bool from_outside = SurfaceError(p, p.ToLocal(ray.origin)) > 0;
      if (closed && from_outside &&
          p.Intersect(Ray{ray.origin, -ray.direction}, 0, kNoHit) == kNoHit) {
        ASSERT_LE(p.NormalAt(point).dot(ray.direction), kExact);
      }
      // Nothing is hit before, and the range is respected.
      ASSERT_EQ(p.Intersect(ray, 0, t), kNoHit);
    }
    EXPECT_GT(hits, 500);
  }
}

TEST(Primitive, HandWorkedSphereBoxAndCylinder) {
  const Ray ray{Vector3d(0, 0, -5), Vector3d(0, 0, 1)};
  Primitive p;
  p.shape = Primitive::Shape::kSphere;
  p.half = Vector3d::Constant(2);
  EXPECT_DOUBLE_EQ(p.Intersect(ray, 0, kNoHit), 3);
  EXPECT_DOUBLE_EQ(p.Intersect(ray, 3.5, kNoHit), 7);
  p.shape = Primitive::Shape::kBox;
  p.half = Vector3d(1, 1, 0.5);
  EXPECT_DOUBLE_EQ(p.Intersect(ray, 0, kNoHit), 4.5);
  EXPECT_DOUBLE_EQ(p.Intersect({Vector3d::Zero(), Vector3d(2, 0, 0)}, 0, kNoHit), 0.5);
  p.shape = Primitive::Shape::kCylinder;
  p.half = Vector3d(1, 1, 1.5);
  EXPECT_DOUBLE_EQ(p.Intersect(ray, 0, kNoHit), 3.5);
  EXPECT_DOUBLE_EQ(p.Intersect({Vector3d(-5, 0, 0), Vector3d(1, 0, 0)}, 0, kNoHit), 4);
  EXPECT_EQ(p.Intersect({Vector3d(-5, 0, 2), Vector3d(1, 0, 0)}, 0, kNoHit), kNoHit);
}

TEST(Scene, TreeFindsWhatTestingEveryPrimitiveFinds) {
  const Scene scene = MakeScene("courtyard", 3);
  Random random(2);
  for (int i = 0; i < 20000; ++i) {
    const Ray ray{Vector3d(random.Uniform(-6, 6), random.Uniform(-6, 5), random.Uniform(0.1, 3)),
                  RandomDirection(random)};
    double nearest = kNoHit;
    for (const Primitive& p : scene.primitives()) {
      nearest = std::min(nearest, p.Intersect(ray, 0, nearest));
    }
    const auto hit = scene.Intersect(ray);
    ASSERT_TRUE(hit);
    ASSERT_EQ(hit->t, nearest);
    const int guess = random.Index(static_cast<int>(scene.primitives().size()));
    ASSERT_EQ(scene.Intersect(ray, kNoHit, guess)->t, nearest);
    ASSERT_TRUE(scene.IsBlocked(ray, 0, nearest * 1.001));
    ASSERT_FALSE(scene.IsBlocked(ray, 0, nearest));
  }
}

TEST(Scene, PlaneDepthIsTheClosedForm) {
  const Scene scene = MakeScene("plane", 1);
  const double tilt = 25 * std::numbers::pi / 180;
  const Vector3d normal(0, -std::cos(tilt), std::sin(tilt));
  for (const std::string& layout : scene.framing().layouts) {
    const PinholeCamera camera = MakeCamera(96, 64);
    for (const Pose& pose : MakeLayout(scene, layout, 16)) {
      const Vector3d eye = pose.TargetOriginInSource();
      for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 96; ++x) {
          const Vector3d d = pose.rotation.conjugate() * camera.RayFromPixel({x + 0.5, y + 0.5});
          const double z = -normal.dot(eye) / normal.dot(d);
          const auto hit = scene.Intersect({eye, d});
          ASSERT_TRUE(hit) << layout << ": the plane must fill every frame";
          ASSERT_NEAR(hit->t / z, 1, kExact);
        }
      }
    }
  }
}

TEST(Scene, SphereDepthIsTheClosedForm) {
  const Scene scene = MakeScene("sphere", 1);
  const PinholeCamera camera = MakeCamera(240, 160);
  int on_sphere = 0;
  for (const Pose& pose : MakeLayout(scene, "arc", 4)) {
    const Vector3d eye = pose.TargetOriginInSource();
    for (int y = 0; y < 160; ++y) {
      for (int x = 0; x < 240; ++x) {
        const Vector3d d = pose.rotation.conjugate() * camera.RayFromPixel({x + 0.5, y + 0.5});
        // |eye + z d|^2 = 1.5^2 in extended precision.
        const long double a = d.squaredNorm(), b = static_cast<long double>(eye.dot(d)),
                          c = static_cast<long double>(eye.squaredNorm()) - 2.25L;
        const long double discriminant = b * b - a * c;
        if (discriminant < 2.25L * a * kAwayFromSilhouette) continue;
        const double z = static_cast<double>((-b - std::sqrt(discriminant)) / a);
        const auto hit = scene.Intersect({eye, d});
        ASSERT_TRUE(hit);
        ASSERT_NEAR(hit->t / z, 1, kExact);
        ++on_sphere;
      }
    }
  }
  EXPECT_GT(on_sphere, 20000);
}

TEST(Scene, RadianceDoesNotDependOnWhereOneLooksFrom) {
  const Scene scene = MakeScene("room", 1);
  Random random(5);
  int compared = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d a(0.3, 0.2, 1.5), b(-0.4, -0.1, 1.6);
    const auto from_a = scene.Intersect({a, RandomDirection(random)});
    ASSERT_TRUE(from_a);
    const auto from_b = scene.Intersect({b, from_a->p_in_world - b});
    ASSERT_TRUE(from_b);
    if (std::abs(from_b->t - 1) > 1e-9) continue;  // something is in the way
    const Vector3d ra = scene.Radiance(*from_a, 0.004), rb = scene.Radiance(*from_b, 0.004);
    // Shadow edges and joints may fall between the two roundings of the same point.
    if ((ra - rb).norm() < 1e-6) ++compared;
  }
  EXPECT_GT(compared, 1500);
}

TEST(Scene, UnknownNamesAreRejectedWithTheKnownOnes) {
  try {
    MakeScene("castle", 1);
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("courtyard"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("castle"), std::string::npos);
  }
}

TEST(Scene, SeedsChangeTexturesAndNotTheFraming) {
  const Scene one = MakeScene("plane", 1), two = MakeScene("plane", 2),
              again = MakeScene("plane", 1);
  const Ray ray{Vector3d(0, -6, 0), Vector3d(0.1, 1, 0.05)};
  const auto hit = one.Intersect(ray);
  ASSERT_TRUE(hit);
  EXPECT_EQ(one.Radiance(*hit, 0.01), again.Radiance(*hit, 0.01));
  EXPECT_NE(one.Radiance(*hit, 0.01), two.Radiance(*two.Intersect(ray), 0.01));
  EXPECT_EQ(one.framing().distance, two.framing().distance);
}

}  // namespace
}  // namespace dtr::datasets
