// Scenes for OpenMVS and for MPEG's immersive video, read back by formulas of this file alone: the
// pixels of their depth must be those of the set's own cameras.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "pipeline/core/cameras/camera_formats.h"
#include "pipeline/core/cameras/foreign_cameras.h"
#include "pipeline/export/export.h"
#include "tests/pipeline/exact_export.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string BytesOf(const fs::path& file) { return ReadFile(file, 1 << 26); }

// Numbers one after the other, as the machine has them.
class Bytes {
 public:
  explicit Bytes(const fs::path& file) : bytes_(BytesOf(file)) {}

  template <typename T>
  T Next() {
    T value{};
    EXPECT_LE(at_ + sizeof value, bytes_.size());
    if (at_ + sizeof value <= bytes_.size()) std::memcpy(&value, &bytes_[at_], sizeof value);
    at_ += sizeof value;
    return value;
  }
  std::string Text(size_t size) {
    const std::string text = bytes_.substr(at_, size);
    at_ += size;
    return text;
  }
  std::string Text() { return Text(Next<std::uint64_t>()); }
  Eigen::Matrix3d Matrix() {
    Eigen::Matrix3d m;
    for (int i = 0; i < 9; ++i) m(i / 3, i % 3) = Next<double>();
    return m;
  }
  Eigen::Vector3d Vector() {
    Eigen::Vector3d v;
    for (double& value : v) value = Next<double>();
    return v;
  }
  bool AtEnd() const { return at_ == bytes_.size(); }

 private:
  std::string bytes_;
  size_t at_ = 0;
};

class ExportOfExactScene : public ExactExport {
 protected:
  void Make(const ExactSetOptions& options) { MakeWithHeldOut(options); }
  // A point that a file puts at an image's pixel (centre of the first at 0.5) and depth.
  static void ExpectSeenAt(const View& view, const Eigen::Vector3d& p, double u, double v,
                           double z) {
    const auto pixel = view.camera.PixelFromCam(view.cam_from_world * p);
    ASSERT_TRUE(pixel);
    EXPECT_LT((*pixel - Eigen::Vector2d(u, v)).norm(), kResidualPx);
    EXPECT_NEAR((view.cam_from_world * p).z() / z, 1, 1e-5);
  }

  static constexpr size_t kSources[] = {0, 1, 2, 4};
};

TEST_F(ExportOfExactScene, OpenMvsHasDepthWithNormalsAndConfidence) {
  ExactSetOptions options;
  options.depth_scale = 2;
  Make(options);
  const pipeline::ExportRequest request = Request("openmvs");
  EXPECT_EQ(pipeline::ExportOpenmvs(request, noted_).depth_maps, 4u);
  for (std::uint32_t image = 0; image < 4; ++image) {
    const View& view = views_[kSources[image]];
    Bytes file(request.output / ("depth000" + std::to_string(image) + ".dmap"));
    EXPECT_EQ(file.Text(2), "DR");
    EXPECT_EQ(file.Next<std::uint8_t>(), 1 | 2 | 4);
    file.Next<std::uint8_t>();
    EXPECT_EQ(file.Next<std::uint32_t>(), 96u);
    EXPECT_EQ(file.Next<std::uint32_t>(), 72u);
    ASSERT_EQ(file.Next<std::uint32_t>(), 48u);
    ASSERT_EQ(file.Next<std::uint32_t>(), 36u);
    const auto near = file.Next<float>(), far = file.Next<float>();
    EXPECT_LT(near, far);
    EXPECT_TRUE(fs::exists(request.output / file.Text(file.Next<std::uint16_t>())));
    const auto count = file.Next<std::uint32_t>();
    EXPECT_EQ(count, 4u) << "itself and its three neighbours";
    EXPECT_EQ(file.Next<std::uint32_t>(), image);
    for (std::uint32_t i = 1; i < count; ++i) EXPECT_LT(file.Next<std::uint32_t>(), 4u);
    Eigen::Matrix3d k = file.Matrix();
    const Eigen::Matrix3d r = file.Matrix();
    const Eigen::Vector3d c = file.Vector();
    // OpenMVS' own rule for another size.
    for (int i = 0; i < 2; ++i) {
      k(i, i) /= 2;
      k(i, 2) = (k(i, 2) + 0.5) / 2 - 0.5;
    }
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 48 * 36; ++i) {
      const double z = file.Next<float>(), x = i % 48, y = i / 48;
      points.emplace_back((x - k(0, 2)) / k(0, 0) * z, (y - k(1, 2)) / k(1, 1) * z, z);
      if (z == 0) continue;
      EXPECT_NEAR(z, view.depth(i % 48, i / 48), 1e-5 * z);
      ExpectSeenAt(view, r.transpose() * points.back() + c, 2 * (x + 0.5), 2 * (y + 0.5), z);
    }
    for (const Eigen::Vector3d& p : points) {
      Eigen::Vector3d normal;
      for (double& v : normal) v = file.Next<float>();
      if (p.z() == 0) {
        EXPECT_EQ(normal.norm(), 0);
      } else {
        EXPECT_NEAR(normal.norm(), 1, 1e-5);
        EXPECT_LT(normal.dot(p), 0) << "it points to the camera";
      }
    }
    for (const Eigen::Vector3d& p : points) {
      const auto confidence = file.Next<float>();
      // sigma of 1/z is 0.1 px / (f b): of z it is z^2 times that, and z / that is 1 per cent of
      // it.
      const double sigma_of_inverse = 0.1 / (view.camera.fx_px() * 0.5);
      if (p.z() > 0) {
        EXPECT_NEAR(confidence * p.z() * sigma_of_inverse, 0.01, 2e-4);
      }
    }
    EXPECT_TRUE(file.AtEnd());
  }
}

TEST_F(ExportOfExactScene, OpenMvsHasCamerasAndPoints) {
  Make({});
  const pipeline::ExportRequest request = Request("openmvs");
  const pipeline::ExportReport report = pipeline::ExportOpenmvs(request, noted_);
  Bytes file(request.output / "scene.mvs");
  EXPECT_EQ(file.Text(4), "MVSI");
  EXPECT_EQ(file.Next<std::uint32_t>(), 5u);
  file.Next<std::uint32_t>();
  ASSERT_EQ(file.Next<std::uint64_t>(), 1u);
  file.Text();
  ASSERT_EQ(file.Next<std::uint64_t>(), 4u);
  std::vector<Eigen::Matrix3d> k, r;
  std::vector<Eigen::Vector3d> c;
  for (int i = 0; i < 4; ++i) {
    file.Text();
    file.Text();
    EXPECT_EQ(file.Next<std::uint32_t>(), 96u);
    EXPECT_EQ(file.Next<std::uint32_t>(), 72u);
    k.push_back(file.Matrix());
    EXPECT_TRUE(file.Matrix().isIdentity(0));
    EXPECT_TRUE(file.Vector().isZero(0));
  }
  ASSERT_EQ(file.Next<std::uint64_t>(), 4u);
  for (int i = 0; i < 4; ++i) {
    r.push_back(file.Matrix());
    c.push_back(file.Vector());
  }
  ASSERT_EQ(file.Next<std::uint64_t>(), 4u);
  for (std::uint32_t i = 0; i < 4; ++i) {
    EXPECT_TRUE(fs::exists(request.output / file.Text()));
    EXPECT_EQ(file.Text(), "") << "the set has no masks";
    EXPECT_EQ(file.Next<std::uint32_t>(), 0u);
    for (int number = 0; number < 3; ++number) EXPECT_EQ(file.Next<std::uint32_t>(), i);
  }
  ASSERT_EQ(file.Next<std::uint64_t>(), report.points);
  EXPECT_GT(report.points, 100u);
  for (size_t p = 0; p < report.points; ++p) {
    Eigen::Vector3d point;
    for (double& v : point) v = file.Next<float>();
    const auto images = file.Next<std::uint64_t>();
    ASSERT_GE(images, 2u);
    for (std::uint64_t i = 0; i < images; ++i) {
      const auto image = file.Next<std::uint32_t>();
      ASSERT_LT(image, 4u);
      file.Next<float>();
      const Eigen::Vector3d pixel = k[image] * (r[image] * (point - c[image]));
      const View& view = views_[kSources[image]];
      ExpectSeenAt(view, point, pixel.x() / pixel.z() + 0.5, pixel.y() / pixel.z() + 0.5,
                   pixel.z());
    }
  }
  EXPECT_EQ(file.Next<std::uint64_t>(), 0u);
  ASSERT_EQ(file.Next<std::uint64_t>(), report.points);
  file.Text(3 * report.points);
  for (int list = 0; list < 3; ++list) EXPECT_EQ(file.Next<std::uint64_t>(), 0u);
  for (int i = 0; i < 16; ++i) EXPECT_EQ(file.Next<double>(), i % 5 == 0 ? 1 : 0);
  EXPECT_TRUE(file.AtEnd());
}

TEST_F(ExportOfExactScene, ImmersiveVideoHasCamerasDepthAndTexture) {
  Make({});
  const pipeline::ExportRequest request = Request("miv");
  EXPECT_EQ(pipeline::ExportMiv(request, noted_).depth_maps, 4u);
  const json sequence = json::parse(BytesOf(request.output / "sequence.json"));
  ASSERT_EQ(sequence["cameras"].size(), 5u);
  EXPECT_EQ(sequence["cameras"][4]["Name"], "viewport");
  for (size_t i = 0; i < 4; ++i) {
    const json& camera = sequence["cameras"][i];
    const View& view = views_[kSources[i]];
    EXPECT_EQ(camera["Name"], sequence["sourceCameraNames"][i]);
    constexpr double kRad = std::numbers::pi / 180;
    const auto angle = [&](size_t k) { return camera["Rotation"][k].get<double>() * kRad; };
    const Eigen::Quaterniond turn = Eigen::AngleAxisd(angle(0), Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(angle(1), Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(angle(2), Eigen::Vector3d::UnitX());
    const auto numbers = [&](const char* name, size_t k) { return camera[name][k].get<double>(); };
    const Eigen::Vector3d position(numbers("Position", 0), numbers("Position", 1),
                                   numbers("Position", 2));
    const double near = numbers("Depth_range", 0), far = numbers("Depth_range", 1);
    Bytes file(request.output / camera["NameDepth"].get<std::string>());
    for (int k = 0; k < 96 * 72; ++k) {
      const int x = k % 96, y = k / 96;
      const auto code = file.Next<std::uint16_t>();
      EXPECT_EQ(code == 0, view.depth(x, y) == 0);
      if (code == 0) continue;
      const double z = 1 / (1 / far + (1 / near - 1 / far) * code / 65535);
      // Half a step; a whole one for the farthest, as code 0 says that there is none.
      const double step = (1 / near - 1 / far) / 65535;
      EXPECT_NEAR(1 / z, 1 / view.depth(x, y), (code == 1 ? 1.01 : 0.51) * step);
      // x forward, y left, z up.
      const double u = x + 0.5, v = y + 0.5;
      const Eigen::Vector3d ray(1, -(u - numbers("Principle_point", 0)) / numbers("Focal", 0),
                                -(v - numbers("Principle_point", 1)) / numbers("Focal", 1));
      const Eigen::Vector3d p = turn * (z * ray) + position;
      ExpectSeenAt(view, {-p.y(), -p.z(), p.x()}, u, v, z);
    }
    for (int k = 0; k < 96 * 72 / 2; ++k) EXPECT_EQ(file.Next<std::uint16_t>(), 32768);
    EXPECT_TRUE(file.AtEnd());
  }
}

TEST_F(ExportOfExactScene, ImmersiveVideoHasTheColours) {
  Make({});
  const pipeline::ExportRequest request = Request("miv");
  pipeline::ExportMiv(request, noted_);
  const json sequence = json::parse(BytesOf(request.output / "sequence.json"));
  const View& view = views_[1];
  Bytes file(request.output / sequence["cameras"][1]["NameColor"].get<std::string>());
  std::vector<double> planes;
  for (int k = 0; k < 96 * 72 * 3 / 2; ++k) planes.push_back(file.Next<std::uint16_t>());
  EXPECT_TRUE(file.AtEnd());
  double error = 0;
  for (int y = 0; y < 72; ++y) {
    for (int x = 0; x < 96; ++x) {
      const size_t chroma = static_cast<size_t>(96 * 72 + y / 2 * 48 + x / 2);
      const double luma = (planes[static_cast<size_t>(y * 96 + x)] - 64) / 876;
      const double blue = (planes[chroma] - 512) / 896,
                   red = (planes[chroma + 48 * 36] - 512) / 896;
      const double r = luma + 1.5748 * red, b = luma + 1.8556 * blue;
      const double g = (luma - 0.2126 * r - 0.0722 * b) / 0.7152;
      error += std::abs(255 * r - view.image(x, y, 0)) + std::abs(255 * g - view.image(x, y, 1)) +
               std::abs(255 * b - view.image(x, y, 2));
    }
  }
  // Colour differences are means of four pixels; the stored image is a JPEG of the one here.
  EXPECT_LT(error / (96 * 72 * 3), 4);
}

// What `dtr import --cameras` reads of them are the set's own cameras, unit and origin.
TEST_F(ExportOfExactScene, MvsnetAndImmersiveVideoAreReadAsTheCamerasOfTheSet) {
  constexpr double kSame = 1e-9;
  Make({});
  const DtrSet set = io::ReadSet(Request("").set);
  pipeline::ExportMvsnet(Request("mvsnet"), noted_);
  pipeline::ExportMiv(Request("miv"), noted_);
  const std::pair<const char*, fs::path> exports[] = {
      {"mvsnet", Request("mvsnet").output}, {"miv", Request("miv").output / "sequence.json"}};
  for (const auto& [format, file] : exports) {
    SCOPED_TRACE(format);
    const pipeline::CameraFormat recognised = pipeline::FormatOf(file, "", "`cameras`");
    ASSERT_EQ(std::string(recognised.name), format);
    std::map<std::string, const View*> view_of;
    std::vector<std::string> names;
    for (size_t i = 0; i < 4; ++i) {
      const View& view = views_[kSources[i]];
      names.push_back(std::string(format) == "miv" ? view.name
                                                   : "0000000" + std::to_string(i) + ".jpg");
      view_of[names.back()] = &view;
    }
    const auto placed =
        pipeline::PlaceCameras(recognised.read(file), file.string(), pipeline::PhotoNames(names),
                               [&](const std::string& name) {
                                 const PinholeCamera& camera = view_of.at(name)->camera;
                                 return io::SizedImage{name, camera.width_px(), camera.height_px()};
                               });
    ASSERT_EQ(placed.list.cameras.size(), 4u);
    EXPECT_EQ(placed.list.unit, set.unit);
    EXPECT_EQ(placed.list.world_origin, set.world_origin);
    for (const io::NamedCamera& named : placed.list.cameras) {
      const View& view = *view_of.at(named.name);
      EXPECT_LT(named.cam_from_world.rotation.angularDistance(view.cam_from_world.rotation), kSame);
      EXPECT_LT((named.cam_from_world.translation - view.cam_from_world.translation).norm(), kSame);
      EXPECT_NEAR(named.camera.fx_px(), view.camera.fx_px(), kSame);
      EXPECT_NEAR(named.camera.cy_px(), view.camera.cy_px(), kSame);
    }
  }
}

TEST_F(ExportOfExactScene, BothRejectWhatIsThere) {
  Make({});
  const pipeline::ExportRequest request = Request("there");
  fs::create_directory(request.output);
  EXPECT_THROW(pipeline::ExportOpenmvs(request, noted_), UsageError);
  EXPECT_THROW(pipeline::ExportMiv(request, noted_), UsageError);
}

}  // namespace
}  // namespace dtr::testing
