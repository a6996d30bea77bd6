// Depth for other programs: every file is read back by formulas of this file alone, whose pixels
// must be those of the set's own cameras.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "calib/lens_camera.h"
#include "dtr/base/error.h"
#include "dtr/base/process.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/formats/npy.h"
#include "dtr/io/formats/pfm.h"
#include "dtr/io/image_io.h"
#include "pipeline/export/detail/depth_file.h"
#include "pipeline/export/export.h"
#include "tests/pipeline/exact_export.h"
#include "tests/pipeline/read_ply.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using pipeline::DepthFileFormat;

constexpr double kSameFloat = 1e-6;  // relative

json JsonIn(const fs::path& file) { return json::parse(ReadFile(file, 1 << 24)); }

// A world point from a pixel by a 4x4 cam_from_world and the numbers of a pinhole camera.
Eigen::Vector3d Unproject(const json& rows, double fx, double fy, double cx, double cy, double u,
                          double v, double z) {
  Eigen::Matrix3d r;
  Eigen::Vector3d t;
  for (int i = 0; i < 3; ++i) {
    const auto row = static_cast<size_t>(i);
    for (int j = 0; j < 3; ++j) r(i, j) = rows[row][static_cast<size_t>(j)].get<double>();
    t[i] = rows[row][3].get<double>();
  }
  return r.transpose() * (Eigen::Vector3d((u - cx) / fx * z, (v - cy) / fy * z, z) - t);
}

class ExportOfExactDepth : public ExactExport {
 protected:
  void Make(const ExactSetOptions& options = {}) { MakeWithHeldOut(options); }
  // The point that the view's own camera has at a depth pixel.
  void ExpectSamePlace(const View& view, int x, int y, const Eigen::Vector3d& p) const {
    const auto pixel = view.DepthCamera().PixelFromCam(view.cam_from_world * p);
    ASSERT_TRUE(pixel);
    EXPECT_LT((*pixel - Eigen::Vector2d(x + 0.5, y + 0.5)).norm(), kResidualPx);
    EXPECT_NEAR((view.cam_from_world * p).z() / view.depth(x, y), 1, 1e-4);
  }
};

TEST_F(ExportOfExactDepth, CamerasAndNumbersPutEveryPixelWhereTheSetHasIt) {
  ExactSetOptions options;
  options.depth_scale = 2;
  Make(options);
  for (const DepthKind kind : {DepthKind::kPlaneZ, DepthKind::kRayDistance}) {
    pipeline::ExportRequest request = Request(kind == DepthKind::kPlaneZ ? "z" : "ray");
    request.depth_kind = kind;
    EXPECT_EQ(pipeline::ExportDepth(request, noted_).depth_maps, views_.size() - 1);
    const json cameras = JsonIn(request.output / "cameras.json");
    for (size_t v = 0; v < views_.size(); ++v) {
      const json& view = cameras["views"][v];
      EXPECT_EQ(view["photo"], views_[v].name);
      EXPECT_TRUE(fs::exists(request.output / "images" / view["name"].get<std::string>()));
      ASSERT_EQ(view.contains("depth"), !views_[v].depth.empty());
      if (views_[v].depth.empty()) continue;
      EXPECT_EQ(view["depth"], "left/photo " + std::to_string(v) + ".exr");
      const Grid<float> depth =
          io::ReadFloatGrid(request.output / "depth" / view["depth"].get<std::string>());
      const double s = view["depth_scale"].get<double>();
      for (int y = 0; y < depth.height(); y += 3) {
        for (int x = 0; x < depth.width(); x += 3) {
          const double fx = view["fx"], fy = view["fy"], cx = view["cx"], cy = view["cy"];
          const double u = s * (x + 0.5), w = s * (y + 0.5);
          const double ray = std::hypot((u - cx) / fx, (w - cy) / fy, 1.0);
          const double z = depth(x, y) / (kind == DepthKind::kPlaneZ ? 1 : ray);
          ExpectSamePlace(views_[v], x, y,
                          Unproject(view["cam_from_world"], fx, fy, cx, cy, u, w, z));
        }
      }
    }
  }
}

TEST_F(ExportOfExactDepth, EveryFormatHoldsTheSameNumbers) {
  Make();
  const float z = views_[0].depth(40, 20);
  const std::string stem = "left/photo 0";
  const std::vector<std::pair<DepthFileFormat, std::string>> formats = {
      {DepthFileFormat::kExr, ".exr"},
      {DepthFileFormat::kPfm, ".pfm"},
      {DepthFileFormat::kNpy, ".npy"},
      {DepthFileFormat::kPng16, ".png"}};
  for (const auto& [format, extension] : formats) {
    pipeline::ExportRequest request = Request("out" + extension);
    request.depth_format = format;
    pipeline::ExportDepth(request, noted_);
    const fs::path file = request.output / "depth" / (stem + extension);
    const double unit =
        JsonIn(request.output / "cameras.json")["conventions"]["scene_units_per_step"];
    if (format == DepthFileFormat::kExr) {
      EXPECT_NEAR(io::ReadFloatGrid(file)(40, 20) / z, 1, kSameFloat);
    }
    if (format == DepthFileFormat::kPfm) {
      EXPECT_NEAR(io::ReadPfm(file)(40, 20) / z, 1, kSameFloat);
    }
    if (format == DepthFileFormat::kNpy) {
      const io::NpyArray array = io::ReadNpy(file);
      ASSERT_EQ(array.shape, (std::vector<size_t>{72, 96}));
      EXPECT_NEAR(array.values[20 * 96 + 40] / z, 1, kSameFloat);
    }
    if (format == DepthFileFormat::kPng16) {
      EXPECT_NEAR(io::ReadPng16(file)(40, 20) * unit, z, 0.51 * unit);
      EXPECT_LT(unit, 0.001);
    }
    EXPECT_EQ(io::ReadMask(request.output / "valid" / (stem + ".png"))(40, 20), 255);
    const Grid<float> sigma = format == DepthFileFormat::kPfm
                                  ? io::ReadPfm(request.output / "sigma" / (stem + ".pfm"))
                              : format == DepthFileFormat::kNpy
                                  ? Grid<float>()
                                  : io::ReadFloatGrid(request.output / "sigma" / (stem + ".exr"));
    // A tenth of a pixel of disparity at z.
    if (!sigma.empty()) {
      EXPECT_NEAR(sigma(40, 20), 0.1 / (100 * 0.5) * z * z, 0.01 * 0.002 * z * z);
    }
  }
}

TEST_F(ExportOfExactDepth, NumpyReadsNpy) {
  const ProcessResult there = RunProcess({"/usr/bin/python3", "-c", "import numpy"}, {});
  if (!there.Ok()) GTEST_SKIP() << "no numpy";
  Make();
  pipeline::ExportRequest request = Request("out");
  request.depth_format = DepthFileFormat::kNpy;
  pipeline::ExportDepth(request, noted_);
  const fs::path text = folder_ / "value.txt";
  const ProcessResult ran =
      RunProcess({"/usr/bin/python3", "-c",
                  "import numpy, sys; a = numpy.load(sys.argv[1]); "
                  "open(sys.argv[2], 'w').write('%s %d %d %.9g' % (a.dtype, *a.shape, a[20, 40]))",
                  (request.output / "depth/left/photo 0.npy").string(), text.string()},
                 {});
  ASSERT_TRUE(ran.Ok());
  std::istringstream words(ReadFile(text, 1000));
  std::string type;
  int height = 0, width = 0;
  double value = 0;
  words >> type >> height >> width >> value;
  EXPECT_EQ(type, "float32");
  EXPECT_EQ(height, 72);
  EXPECT_EQ(width, 96);
  EXPECT_NEAR(value / views_[0].depth(40, 20), 1, kSameFloat);
}

TEST_F(ExportOfExactDepth, MillimetresWhereTheSetIsInMetres) {
  EXPECT_EQ(pipeline::Png16Unit(LengthUnit::kMetre, 65.5), 0.001);
  EXPECT_NEAR(pipeline::Png16Unit(LengthUnit::kMetre, 131.07), 0.002, 1e-12);
  EXPECT_GE(65535 * pipeline::Png16Unit(LengthUnit::kArbitrary, 9.99), 9.99);
  DepthImage depth(2, 1);
  depth(0, 0) = 0.0001f;
  const Grid<std::uint16_t> codes = pipeline::Png16Codes(depth, 0.001);
  EXPECT_EQ(codes(0, 0), 1);  // not a hole
  EXPECT_EQ(codes(1, 0), 0);
  depth(1, 0) = 70;
  EXPECT_THROW(pipeline::Png16Codes(depth, 0.001), Error);
}

TEST_F(ExportOfExactDepth, OnThePhotosGridItFollowsTheLens) {
  const calib::LensCamera lens{
      calib::CameraModel::kOpenCv, 192, 144, {200, 202, 94.6, 73.8, -0.12, 0.03, 0.001, -0.002}};
  json provenance;
  provenance["lenses"] = json::array();
  provenance["lenses"].push_back(
      {{"model", "OPENCV"}, {"width_px", 192}, {"height_px", 144}, {"params", lens.params}});
  for (int i = 0; i < 5; ++i) {
    provenance["photos"].push_back(
        {{"name", "left/photo " + std::to_string(i) + ".JPG"}, {"lens", 0}});
  }
  ExactSetOptions options;
  options.provenance_json = provenance.dump();
  Make(options);
  pipeline::ExportRequest request = Request("photo");
  request.depth_grid = pipeline::DepthGrid::kPhoto;
  request.depth_kind = DepthKind::kRayDistance;
  pipeline::ExportDepth(request, noted_);
  const Grid<float> depth = io::ReadFloatGrid(request.output / "depth/left/photo 0.exr");
  ASSERT_EQ(depth.width(), 192);
  ASSERT_EQ(depth.height(), 144);
  const Pose world_from_cam = views_[0].cam_from_world.Inverse();
  double worst = 0;
  size_t seen = 0;
  for (int y = 4; y < 140; y += 5) {
    for (int x = 4; x < 188; x += 5) {
      const auto ray = lens.RayFromPixel({x + 0.5, y + 0.5});
      if (!ray || !(depth(x, y) > 0)) continue;
      const auto truth_at = [&](double dx, double dy) {
        const auto there = lens.RayFromPixel({x + 0.5 + dx, y + 0.5 + dy});
        return there ? SlantedScene()(world_from_cam.translation, world_from_cam.rotation * *there)
                     : 0.0;
      };
      const double truth = truth_at(0, 0);
      // Not beside the square or the image's border, where depth is the nearest sample's.
      const auto flat = views_[0].camera.PixelFromCam(*ray);
      bool inside = flat->x() > 1 && flat->y() > 1 && flat->x() < 95 && flat->y() < 71;
      for (const int step : {-3, 3}) {
        inside = inside && std::abs(truth_at(step, 0) / truth - 1) < 0.03 &&
                 std::abs(truth_at(0, step) / truth - 1) < 0.03;
      }
      if (!inside) continue;
      worst = std::max(worst, std::abs(depth(x, y) / truth - 1));
      ++seen;
    }
  }
  EXPECT_GT(seen, 500u);
  // Half a pixel on the slanted plane is 1e-3 of its distance at the least.
  EXPECT_LT(worst, 5e-5);
  EXPECT_EQ(JsonIn(request.output / "cameras.json")["views"][0]["lens"]["model"], "OPENCV");
}

TEST_F(ExportOfExactDepth, ALensThatTheSetDoesNotKnowIsSaidInOneLine) {
  Make();
  pipeline::ExportRequest request = Request("photo");
  request.depth_grid = pipeline::DepthGrid::kPhoto;
  try {
    pipeline::ExportDepth(request, noted_);
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("the set does not know the lens"));
  }
  EXPECT_FALSE(fs::exists(request.output));
}

TEST_F(ExportOfExactDepth, NerfstudioHasOpenGlCamerasDepthForAllAndPoints) {
  ExactSetOptions options;
  options.depth_scale = 2;
  options.world_origin = {500000, 4500000.25, 100};
  Make(options);
  const pipeline::ExportRequest request = Request("nerf");
  const auto report = pipeline::ExportNerfstudio(request, noted_);
  EXPECT_THAT(noted_.lines, ::testing::Contains(::testing::HasSubstr("500000 4500000.25 100")));
  const json file = JsonIn(request.output / "transforms.json");
  ASSERT_EQ(file["frames"].size(), views_.size());
  EXPECT_EQ(file["test_filenames"].size(), 1u);
  EXPECT_EQ(file["applied_transform"][1][3], -4500000.25);
  const double unit = file["depth_unit_scale_factor"];
  for (size_t v = 0; v < views_.size(); ++v) {
    const json& frame = file["frames"][v];
    const Grid<std::uint16_t> depth =
        io::ReadPng16(request.output / frame["depth_file_path"].get<std::string>());
    ASSERT_EQ(depth.width(), frame["w"]);
    const double fx = frame["fl_x"], fy = frame["fl_y"], cx = frame["cx"], cy = frame["cy"];
    Eigen::Matrix4d c2w;
    for (size_t i = 0; i < 4; ++i) {
      for (size_t j = 0; j < 4; ++j) {
        c2w(static_cast<int>(i), static_cast<int>(j)) = frame["transform_matrix"][i][j];
      }
    }
    for (int y = 1; y < depth.height(); y += 9) {
      for (int x = 1; x < depth.width(); x += 9) {
        if (views_[v].depth.empty()) {
          EXPECT_EQ(depth(x, y), 0);
          continue;
        }
        // OpenGL: y up, looking along -z.
        const double z = depth(x, y) * unit, u = x + 0.5, w = y + 0.5;
        const Eigen::Vector4d p =
            c2w * Eigen::Vector4d((u - cx) / fx * z, -(w - cy) / fy * z, -z, 1);
        const auto pixel =
            views_[v].camera.PixelFromCam(views_[v].cam_from_world * Eigen::Vector3d(p.head<3>()));
        ASSERT_TRUE(pixel);
        EXPECT_LT((*pixel - Eigen::Vector2d(u, w)).norm(), kResidualPx);
        EXPECT_NEAR(z, views_[v].depth(x / 2, y / 2), 0.51 * unit);
      }
    }
  }
  const Ply ply = ReadPly(request.output / file["ply_file_path"].get<std::string>());
  EXPECT_EQ(ply.count, report.points);
  EXPECT_GT(ply.count, 100u);
}

TEST_F(ExportOfExactDepth, MvsnetHasCamerasPairsAndDepth) {
  Make();
  const pipeline::ExportRequest request = Request("mvs");
  EXPECT_EQ(pipeline::ExportMvsnet(request, noted_).depth_maps, 4u);
  const std::vector<size_t> sources = {0, 1, 2, 4};
  for (size_t i = 0; i < sources.size(); ++i) {
    const View& view = views_[sources[i]];
    const std::string number = "0000000" + std::to_string(i);
    std::istringstream cam(ReadFile(request.output / "cams" / (number + "_cam.txt"), 10000));
    std::string word;
    double e[16], k[9], range[4];
    cam >> word;
    for (double& value : e) cam >> value;
    cam >> word;
    for (double& value : k) cam >> value;
    for (double& value : range) cam >> value;
    ASSERT_TRUE(cam);
    EXPECT_NEAR(range[0] + range[1] * (range[2] - 1), range[3], 1e-6);
    json rows;
    for (size_t r = 0; r < 3; ++r) {
      rows.push_back({e[4 * r], e[4 * r + 1], e[4 * r + 2], e[4 * r + 3]});
    }
    const Grid<float> depth = io::ReadPfm(request.output / "depths" / (number + ".pfm"));
    for (int y = 0; y < depth.height(); y += 7) {
      for (int x = 0; x < depth.width(); x += 7) {
        EXPECT_GE(depth(x, y), range[0] * 0.999);
        ExpectSamePlace(view, x, y,
                        Unproject(rows, k[0], k[4], k[2], k[5], x + 0.5, y + 0.5, depth(x, y)));
      }
    }
    EXPECT_TRUE(fs::exists(request.output / "images" / (number + ".jpg")));
  }
  std::istringstream pairs(ReadFile(request.output / "pair.txt", 10000));
  int views = 0, reference = 0, count = 0;
  pairs >> views >> reference >> count;
  EXPECT_EQ(views, 4);
  EXPECT_EQ(reference, 0);
  EXPECT_EQ(count, 3);
}

}  // namespace
}  // namespace dtr::testing
