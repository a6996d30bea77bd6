// Meshes of sets whose surfaces are known exactly, and files of glTF.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "pipeline/export/export.h"
#include "tests/pipeline/exact_export.h"
#include "tests/pipeline/read_ply.h"
#include "tests/support/on_threads.h"

namespace dtr::testing {
namespace {

using ::testing::HasSubstr;

// A GLB file of one primitive, read by its specification.
struct Glb {
  nlohmann::json json;
  std::string bin;

  explicit Glb(const std::filesystem::path& path) {
    const std::string bytes = ReadFile(path, 1 << 28);
    const auto number = [&](size_t at) {
      std::uint32_t value = 0;
      std::memcpy(&value, bytes.data() + at, 4);
      return size_t{value};
    };
    EXPECT_EQ(bytes.substr(0, 4), "glTF");
    EXPECT_EQ(number(4), 2u);
    EXPECT_EQ(number(8), bytes.size());
    EXPECT_EQ(bytes.substr(16, 4), "JSON");
    EXPECT_EQ(number(12) % 4, 0u);
    json = nlohmann::json::parse(bytes.substr(20, number(12)));
    const size_t chunk = 20 + number(12);
    EXPECT_EQ(number(chunk), bytes.size() - chunk - 8);
    EXPECT_EQ(bytes.substr(chunk + 4, 4), std::string("BIN\0", 4));
    bin = bytes.substr(chunk + 8);
    EXPECT_EQ(json["buffers"][0]["byteLength"], bin.size());
  }
  const nlohmann::json& Primitive() const { return json["meshes"][0]["primitives"][0]; }
  template <typename T>
  std::vector<T> Numbers(size_t accessor) const {
    const nlohmann::json& view =
        json["bufferViews"][json["accessors"][accessor]["bufferView"].get<size_t>()];
    std::vector<T> numbers(view["byteLength"].get<size_t>() / sizeof(T));
    std::memcpy(numbers.data(), bin.data() + view["byteOffset"].get<size_t>(),
                numbers.size() * sizeof(T));
    return numbers;
  }
  template <typename T>
  std::vector<T> Attribute(const std::string& name) const {
    return Numbers<T>(Primitive()["attributes"][name].get<size_t>());
  }
};

class ExportMeshes : public ExactExport {
 protected:
  Glb MeshFile(const std::string& name, double voxel = 0) {
    pipeline::ExportRequest request = Request(name);
    request.voxel = voxel;
    report_ = pipeline::ExportMesh(request, noted_);
    return Glb(request.output);
  }
  pipeline::ExportReport report_;
};

TEST_F(ExportMeshes, LieOnTheSurfacesAndNotBetweenThem) {
  Make({});
  constexpr double kVoxel = 0.1;
  const std::vector<float> p = MeshFile("mesh.glb", kVoxel).Attribute<float>("POSITION");
  const Eigen::Vector3d plane = Eigen::Vector3d(0.3, -0.2, 1).normalized();
  double sum = 0;
  size_t on_plane = 0, on_square = 0, off = 0;
  for (size_t i = 0; i < p.size(); i += 3) {
    const Eigen::Vector3d at(p[i], p[i + 1], p[i + 2]);
    const double to_plane = plane.dot(at) - 9, to_square = at.z() - 5;
    if (std::abs(to_plane) < kVoxel) {
      ++on_plane;
      sum += to_plane;
    } else if (std::abs(to_square) < kVoxel) {
      ++on_square;
    } else {
      ++off;
    }
  }
  EXPECT_GT(on_plane, 3000u);
  EXPECT_GT(on_square, 100u);
  EXPECT_EQ(off, 0u);
  // Half a pixel off, the slanted plane would be 0.004 off.
  EXPECT_LT(std::abs(sum / static_cast<double>(on_plane)), 5e-4);
}

TEST_F(ExportMeshes, FaceTheCamerasAndAreClosedWithinASurface) {
  Make({});
  const Glb glb = MeshFile("mesh.glb");
  const std::vector<float> p = glb.Attribute<float>("POSITION"), n = glb.Attribute<float>("NORMAL");
  const std::vector<std::uint32_t> v =
      glb.Numbers<std::uint32_t>(glb.Primitive()["indices"].get<size_t>());
  const auto at = [](const std::vector<float>& values, size_t i) {
    return Eigen::Vector3f(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
  };
  EXPECT_EQ(v.size(), 3 * report_.triangles);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  size_t facing = 0;
  for (size_t i = 0; i < v.size(); i += 3) {
    const Eigen::Vector3f cross =
        (at(p, v[i + 1]) - at(p, v[i])).cross(at(p, v[i + 2]) - at(p, v[i]));
    facing += cross.dot(at(n, v[i])) > 0 && cross.z() < 0;
    for (size_t k = 0; k < 3; ++k) {
      ++edges[std::minmax(v[i + k], v[i + (k + 1) % 3])];
    }
  }
  EXPECT_GT(facing, report_.triangles * 99 / 100);
  size_t border = 0;
  for (const auto& [edge, count] : edges) border += count == 1;
  // Those around the two surfaces and the hole that the square leaves.
  EXPECT_LT(border, edges.size() / 20);
}

TEST_F(ExportMeshes, ArePlyOfTheSameOrInDoublesWithTheOrigin) {
  ExactSetOptions options;
  options.world_origin = {500000, 4500000.25, 100};
  Make(options);
  const std::vector<float> p = MeshFile("mesh.glb").Attribute<float>("POSITION");
  EXPECT_THAT(noted_.lines, ::testing::Contains(HasSubstr("relative to 500000 4500000.25 100")));
  pipeline::ExportMesh(Request("mesh.ply"), noted_);
  const Ply ply = ReadPly(folder_ / "mesh.ply");
  ASSERT_EQ(3 * ply.count, p.size());
  for (size_t i = 0; i < ply.count; i += 7) {
    EXPECT_NEAR(ply["x"][i] - 500000, p[3 * i], 1e-6);
    EXPECT_NEAR(ply["y"][i] - 4500000.25, p[3 * i + 1], 1e-6);
  }
}

TEST_F(ExportMeshes, AreTheSameForAnyNumberOfThreadsAndLittleMemory) {
  Make({});
  pipeline::ExportRequest a = Request("a.ply"), b = Request("b.ply");
  b.memory_gb = 1e-5;  // some blocks: the voxel grows
  a.voxel = b.voxel = 0.2;
  OnThreads(1, [&] { return pipeline::ExportMesh(a, noted_); });
  const ThreadLimit limit(3);
  EXPECT_GT(pipeline::ExportMesh(b, noted_).triangles, 0u);
  b.output = folder_ / "c.ply";
  b.memory_gb = a.memory_gb;
  pipeline::ExportMesh(b, noted_);
  EXPECT_EQ(ReadFile(a.output, 1 << 28), ReadFile(b.output, 1 << 28));
}

TEST_F(ExportMeshes, SayWhatFailedAndRejectWhatCannotBe) {
  ExactSetOptions options;
  options.validation_json =
      R"({"passed": false, "tests": [{"name": "reprojection_px", "passed": false}]})";
  Make(options);
  EXPECT_THAT(MeshFile("mesh.glb").json["asset"]["extras"]["validation"].get<std::string>(),
              HasSubstr("FAILED: reprojection_px"));
  EXPECT_THROW(MeshFile("mesh.glb"), UsageError);
  EXPECT_THROW(MeshFile("mesh.obj"), UsageError);
  pipeline::ExportRequest request = Request("none.ply");
  request.min_views = 50;
  EXPECT_THROW(pipeline::ExportMesh(request, noted_), Error);
  EXPECT_FALSE(std::filesystem::exists(request.output));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "none.ply.partial"));
}

TEST_F(ExportMeshes, SplatsOfGlbAreThoseOfPly) {
  Make({});
  pipeline::ExportSplat(Request("splats.ply"), noted_);
  pipeline::ExportSplat(Request("splats.glb"), noted_);
  const Ply ply = ReadPly(folder_ / "splats.ply");
  const Glb glb(folder_ / "splats.glb");
  EXPECT_EQ(glb.Primitive()["mode"], 0);
  EXPECT_EQ(glb.Primitive()["extensions"]["KHR_gaussian_splatting"]["kernel"], "ellipse");
  const std::string prefix = "KHR_gaussian_splatting:";
  const std::vector<float> p = glb.Attribute<float>("POSITION"),
                           scale = glb.Attribute<float>(prefix + "SCALE"),
                           q = glb.Attribute<float>(prefix + "ROTATION"),
                           opacity = glb.Attribute<float>(prefix + "OPACITY"),
                           rgb = glb.Attribute<float>(prefix + "SH_DEGREE_0_COEF_0");
  ASSERT_EQ(p.size(), 3 * ply.count);
  for (size_t i = 0; i < ply.count; i += 11) {
    EXPECT_EQ(p[3 * i + 2], ply["z"][i]);
    EXPECT_NEAR(std::log(scale[3 * i + 1]), ply["scale_1"][i],
                1e-5);                         // as it is, not its logarithm
    EXPECT_EQ(q[4 * i + 3], ply["rot_0"][i]);  // w comes last
    EXPECT_EQ(q[4 * i], ply["rot_1"][i]);
    EXPECT_NEAR(opacity[i], 1 / (1 + std::exp(-ply["opacity"][i])), 1e-5);
    EXPECT_EQ(rgb[3 * i + 1], ply["f_dc_1"][i]);
  }
}

}  // namespace
}  // namespace dtr::testing
