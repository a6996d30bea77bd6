// Clouds and splats of sets whose surfaces are known exactly.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dtr/base/error.h"
#include "dtr/base/process.h"
#include "dtr/base/random.h"
#include "pipeline/export/export.h"
#include "tests/pipeline/exact_export.h"
#include "tests/pipeline/off_centre.h"
#include "tests/pipeline/read_ply.h"
#include "tests/support/message_of.h"
#include "tests/support/on_threads.h"

namespace dtr::testing {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

constexpr double kBeyondAll = 30;  // distance from the origin: surfaces are nearer

std::vector<Eigen::Vector3d> Points(const Ply& ply) {
  std::vector<Eigen::Vector3d> points;
  for (size_t i = 0; i < ply.count; ++i) points.emplace_back(ply["x"][i], ply["y"][i], ply["z"][i]);
  return points;
}

// Share of the views' pixels on whose surface a point lies within `reach_px`.
double Completeness(const std::vector<View>& views, const std::vector<Eigen::Vector3d>& points,
                    double reach_px) {
  long long near = 0, all = 0;
  for (const View& view : views) {
    const PinholeCamera camera = view.DepthCamera();
    Mask seen(camera.width_px(), camera.height_px());
    const int reach = static_cast<int>(std::ceil(reach_px));
    for (const Eigen::Vector3d& p : points) {
      const Eigen::Vector3d q = view.cam_from_world * p;
      const auto pixel = camera.PixelFromCam(q);
      if (!pixel || !camera.Contains(*pixel)) continue;
      const int x = static_cast<int>(pixel->x()), y = static_cast<int>(pixel->y());
      for (int v = y - reach; v <= y + reach; ++v) {
        for (int u = x - reach; u <= x + reach; ++u) {
          if (!seen.Contains(u, v)) continue;
          if ((Eigen::Vector2d(u + 0.5, v + 0.5) - *pixel).norm() > reach_px) continue;
          if (std::abs(view.depth(u, v) / q.z() - 1) < 0.02) seen(u, v) = 1;
        }
      }
    }
    for (size_t i = 0; i < seen.data().size(); ++i) {
      if (DepthImage::IsHole(view.depth.grid().data()[i])) continue;
      ++all;
      near += seen.data()[i];
    }
  }
  return static_cast<double>(near) / static_cast<double>(all);
}

class ExportCloud : public ExactExport {
 protected:
  Ply Cloud(pipeline::ExportRequest request) {
    report_ = pipeline::ExportPly(request, noted_);
    return ReadPly(request.output);
  }
  pipeline::ExportReport report_;
};

TEST_F(ExportCloud, PointsLieOnPixelRaysAndOnTheSurface) {
  Make({});
  const Ply ply = Cloud(Request("cloud.ply"));
  EXPECT_EQ(ply.count, report_.points);
  ASSERT_GT(ply.count, 1000u);
  const Eigen::Vector3d plane = Eigen::Vector3d(0.3, -0.2, 1).normalized();
  size_t on_surface = 0;
  for (size_t i = 0; i < ply.count; ++i) {
    const Eigen::Vector3d p(ply["x"][i], ply["y"][i], ply["z"][i]);
    ASSERT_LT(OffCentrePx(views_, p), kResidualPx);
    on_surface += std::min(std::abs(plane.dot(p) - 9), std::abs(p.z() - 5)) < 0.01 * p.z();
    EXPECT_GE(ply["views"][i], 2);
    EXPECT_GT(ply["sigma"][i], 0);
  }
  EXPECT_GE(on_surface, ply.count * 99 / 100);
}

TEST_F(ExportCloud, ShowsEveryPatchOnceAndAllOfThem) {
  Make({});
  const Ply ply = Cloud(Request("cloud.ply"));
  const size_t of_one_view = views_[0].depth.grid().data().size();
  // All views are as far away: what they show together is little more than one of them shows.
  EXPECT_LT(ply.count, of_one_view * 17 / 10);
  EXPECT_GT(Completeness(views_, Points(ply), 1.5), 0.9);
}

TEST_F(ExportCloud, NormalsAreThoseOfTheSurface) {
  Make({});
  const Ply ply = Cloud(Request("cloud.ply"));
  const Eigen::Vector3d plane = Eigen::Vector3d(0.3, -0.2, 1).normalized();
  size_t good = 0;
  for (size_t i = 0; i < ply.count; ++i) {
    const Eigen::Vector3d n(ply["nx"][i], ply["ny"][i], ply["nz"][i]);
    EXPECT_NEAR(n.norm(), 1, 1e-5);
    const bool square = std::abs(ply["z"][i] - 5) < 0.05;
    good += n.dot(square ? -Eigen::Vector3d::UnitZ() : Eigen::Vector3d(-plane)) > 0.99;
  }
  EXPECT_GT(good, ply.count * 9 / 10);
}

TEST_F(ExportCloud, WhatOneViewAloneHasWrongIsLeftOut) {
  ExactSetOptions options;
  options.sigma_px = 0.1;
  views_ = ExactViews(options);
  for (int y = 20; y < 40; ++y) {
    for (int x = 20; x < 40; ++x) views_[2].depth(x, y) *= 0.7f;
  }
  WriteExactSet(folder_ / "set.dtr", views_, options);
  const Ply ply = Cloud(Request("cloud.ply"));
  const Eigen::Vector3d plane = Eigen::Vector3d(0.3, -0.2, 1).normalized();
  size_t wrong = 0;
  for (const Eigen::Vector3d& p : Points(ply)) {
    wrong += std::min(std::abs(plane.dot(p) - 9), std::abs(p.z() - 5)) > 0.01 * p.z();
  }
  EXPECT_LE(wrong, ply.count / 100);
}

TEST_F(ExportCloud, NoiseIsAveragedByVarianceAndSigmaSaysWhatIsLeft) {
  ExactSetOptions options;
  views_ = ExactViews(options);
  for (size_t v = 0; v < views_.size(); ++v) {
    Random random(v + 1);
    const double sigma_px = v % 2 == 0 ? 0.05 : 0.3;
    const double sigma = sigma_px / (views_[v].camera.fx_px() * options.spacing);
    for (float& z : views_[v].depth.grid().data()) {
      z = static_cast<float>(1 / (1 / z + sigma * random.Normal()));
    }
    views_[v].inverse_depth_sigma = Grid<float>(views_[v].depth.width(), views_[v].depth.height(),
                                                1, static_cast<float>(sigma));
  }
  WriteExactSet(folder_ / "set.dtr", views_, options);
  const Ply ply = Cloud(Request("cloud.ply"));
  const Eigen::Vector3d plane = Eigen::Vector3d(0.3, -0.2, 1).normalized();
  double squares = 0, sigmas = 0;
  size_t count = 0;
  for (size_t i = 0; i < ply.count; ++i) {
    const Eigen::Vector3d p(ply["x"][i], ply["y"][i], ply["z"][i]);
    if (ply["views"][i] < 4 || std::abs(p.z() - 5) < 0.5) continue;
    squares += std::pow(plane.dot(p) - 9, 2);
    sigmas += std::pow(ply["sigma"][i], 2);
    ++count;
  }
  ASSERT_GT(count, 500u);
  const double rms = std::sqrt(squares / static_cast<double>(count));
  const double noisy = 0.3 / (100 * options.spacing) * 81;  // of a view of the worse kind
  EXPECT_LT(rms, 0.35 * noisy);
  EXPECT_LT(rms, 1.3 * std::sqrt(sigmas / static_cast<double>(count)));
}

TEST_F(ExportCloud, IsTheSameForAnyNumberOfThreadsAndLittleMemory) {
  Make({});
  pipeline::ExportRequest a = Request("a.ply"), b = Request("b.ply");
  b.memory_gb = 1e-6;
  OnThreads(1, [&] { return Cloud(a); });
  OnThreads(3, [&] { return Cloud(b); });
  EXPECT_EQ(ReadFile(a.output, 1 << 28), ReadFile(b.output, 1 << 28));
}

TEST_F(ExportCloud, LargeCoordinatesAreDoubles) {
  ExactSetOptions options;
  options.world_origin = {500000, 4500000.25, 100};
  Make(options);
  std::vector<Eigen::Vector3d> points = Points(Cloud(Request("cloud.ply")));
  for (const Eigen::Vector3d& p : points) {
    ASSERT_LT(OffCentrePx(views_, p - options.world_origin), kResidualPx);
  }
}

TEST_F(ExportCloud, LasHoldsTheSamePoints) {
  ExactSetOptions options;
  options.world_origin = {500000, 4500000.25, 100};
  Make(options);
  const Ply ply = Cloud(Request("cloud.ply"));
  EXPECT_EQ(pipeline::ExportLas(Request("cloud.las"), noted_).points, ply.count);
  const std::string las = ReadFile(folder_ / "cloud.las", 1 << 28);
  const auto at = [&](size_t place, auto value) {
    std::memcpy(&value, las.data() + place, sizeof value);
    return value;
  };
  EXPECT_EQ(las.substr(0, 4), "LASF");
  EXPECT_EQ(at(247, std::uint64_t{}), ply.count);
  const size_t first = at(96, std::uint32_t{}), bytes = at(105, std::uint16_t{});
  ASSERT_EQ(las.size(), first + bytes * ply.count);
  for (size_t i = 0; i < ply.count; ++i) {
    Eigen::Vector3d p;
    for (size_t c = 0; c < 3; ++c) {
      p[static_cast<int>(c)] =
          at(first + i * bytes + 4 * c, std::int32_t{}) * at(131 + 8 * c, double{}) +
          at(155 + 8 * c, double{});
      EXPECT_LE(at(187 + 16 * c, double{}), p[static_cast<int>(c)]);
      EXPECT_GE(at(179 + 16 * c, double{}), p[static_cast<int>(c)]);
    }
    ASSERT_LT(OffCentrePx(views_, p - options.world_origin), kResidualPx);
    EXPECT_EQ(at(first + i * bytes + 17, std::uint8_t{}), ply["views"][i]);
    EXPECT_FLOAT_EQ(at(first + i * bytes + 26, float{}), static_cast<float>(ply["sigma"][i]));
  }
}

TEST_F(ExportCloud, PdalReadsLas) {
  const std::string pdal = "/usr/bin/pdal";
  if (!std::filesystem::exists(pdal)) GTEST_SKIP() << "no pdal";
  Make({});
  const size_t points = pipeline::ExportLas(Request("cloud.las"), noted_).points;
  ProcessOptions options;
  options.log_file = folder_ / "log";
  const std::string las = (folder_ / "cloud.las").string();
  ASSERT_TRUE(RunProcess({pdal, "info", "--stats", las}, options).Ok());
  const std::string log = ReadFile(options.log_file, 1 << 20);
  EXPECT_THAT(log, HasSubstr("\"count\": " + std::to_string(points)));
  EXPECT_THAT(log, HasSubstr("\"name\": \"sigma\""));
}

TEST_F(ExportCloud, AFailedValidationStandsInTheFileAndIsNoted) {
  ExactSetOptions options;
  options.validation_json =
      R"({"passed": false, "tests": [{"name": "reprojection_px", "passed": false}]})";
  Make(options);
  EXPECT_TRUE(Cloud(Request("cloud.ply")).HasComment("FAILED: reprojection_px"));
  EXPECT_THAT(noted_.lines, Contains(HasSubstr("FAILED: reprojection_px")));
}

TEST_F(ExportCloud, WhatExistsStaysAndASetWithoutDepthHasNoCloud) {
  Make({});
  WriteFileAtomically(folder_ / "cloud.ply", "mine");
  EXPECT_THROW(Cloud(Request("cloud.ply")), UsageError);
  EXPECT_EQ(ReadFile(folder_ / "cloud.ply", 100), "mine");
  std::vector<View> bare = ExactViews({});
  for (View& view : bare) DropDepth(view);
  WriteExactSet(folder_ / "bare.dtr", bare, {});
  pipeline::ExportRequest request = Request("bare.ply");
  request.set = folder_ / "bare.dtr";
  EXPECT_THROW(pipeline::ExportPly(request, noted_), Error);
  EXPECT_FALSE(std::filesystem::exists(request.output));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "bare.ply.partial"));
}

TEST_F(ExportCloud, SplatsLieOnTheSurfaceFlatAndFacingTheViews) {
  Make({});
  pipeline::ExportRequest request = Request("splats.ply");
  request.full_sh = true;
  report_ = pipeline::ExportSplat(request, noted_);
  const Ply ply = ReadPly(request.output);
  ASSERT_EQ(ply.count, report_.points);
  EXPECT_EQ(ply.names.size(), 62u);  // as Kerbl et al. write them
  const Eigen::Vector3d plane = Eigen::Vector3d(0.3, -0.2, 1).normalized();
  size_t all = 0, on_surface = 0, flat = 0, on_centres = 0;
  for (size_t i = 0; i < ply.count; ++i) {
    const Eigen::Vector3d p(ply["x"][i], ply["y"][i], ply["z"][i]);
    if (p.norm() > kBeyondAll) continue;  // the backdrop
    ++all;
    on_centres += OffCentrePx(views_, p) < kResidualPx;
    const bool square = std::abs(p.z() - 5) < 0.05;
    on_surface += square || std::abs(plane.dot(p) - 9) < 0.09;
    const Eigen::Quaterniond q(ply["rot_0"][i], ply["rot_1"][i], ply["rot_2"][i], ply["rot_3"][i]);
    EXPECT_NEAR(q.norm(), 1, 1e-5);
    // The thinnest axis comes first and is the normal.
    const Eigen::Vector3d thin = q * Eigen::Vector3d::UnitX();
    flat += ply["scale_0"][i] < ply["scale_1"][i] - 0.5 &&
            std::abs(thin.dot(square ? Eigen::Vector3d::UnitZ() : plane)) > 0.95;
  }
  EXPECT_GT(all, 1000u);
  EXPECT_LT(all, ply.count);
  EXPECT_GT(on_surface, all * 98 / 100);
  EXPECT_GT(flat, all * 9 / 10);
  // Those of one pixel; half a pixel off there would be none.
  EXPECT_GT(on_centres, all / 5);
}

TEST_F(ExportCloud, BehindASplatOfEveryViewStandsABackdrop) {
  Make({});
  pipeline::ExportRequest request = Request("splats.ply");
  pipeline::ExportSplat(request, noted_);
  const Ply ply = ReadPly(request.output);
  // The middle of each image, and a place beyond its left border.
  for (const View& view : views_) {
    for (const double u : {0.5, -0.2}) {
      const Eigen::Vector2d pixel(u * view.camera.width_px(), 0.5 * view.camera.height_px());
      bool covered = false;
      for (size_t i = 0; i < ply.count && !covered; ++i) {
        const Eigen::Vector3d p(ply["x"][i], ply["y"][i], ply["z"][i]);
        if (p.norm() < kBeyondAll) continue;
        const Eigen::Vector3d q = view.cam_from_world * p;
        const auto at = view.camera.PixelFromCam(q);
        const double deviation_px = std::exp(ply["scale_1"][i]) * view.camera.fx_px() / q.z();
        covered = at && (*at - pixel).norm() < deviation_px;
      }
      EXPECT_TRUE(covered) << view.name << " " << u;
    }
  }
}

TEST_F(ExportCloud, SplatsAreAsFewAsAskedOrSaidNotToBe) {
  Make({});
  pipeline::ExportRequest request = Request("few.splat");
  request.max_count = 3000;
  report_ = pipeline::ExportSplat(request, noted_);
  EXPECT_LE(report_.points, 3000u);
  EXPECT_GT(report_.points, 1500u);
  EXPECT_EQ(std::filesystem::file_size(request.output), 32 * report_.points);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "few.splat.json"));
  request.output = folder_ / "fewer.splat";
  request.max_count = 3;
  const std::string why = MessageOf<Error>([&] { pipeline::ExportSplat(request, noted_); });
  EXPECT_FALSE(std::filesystem::exists(request.output));
  // What it says is the least can be had, one less cannot. Squares that other views show in part
  // are among it: full ones alone would leave more.
  const std::string before = "the least is ";
  const size_t least = std::stoul(why.substr(why.find(before) + before.size()));
  EXPECT_LT(least, 1800u);
  request.max_count = least;
  EXPECT_EQ(pipeline::ExportSplat(request, noted_).points, least);
  request.output = folder_ / "fewest.splat";
  request.max_count = least - 1;
  EXPECT_THROW(pipeline::ExportSplat(request, noted_), Error);
}

}  // namespace
}  // namespace dtr::testing
