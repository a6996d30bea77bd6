// Exported files read by programs that are not ours; each says SKIPPED where its program is not
// there. docs/EXPORT.md says which.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "dtr/base/files.h"
#include "dtr/base/process.h"
#include "pipeline/export/export.h"
#include "tests/pipeline/exact_export.h"
#include "tests/pipeline/off_centre.h"
#include "tests/pipeline/read_ply.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const fs::path kReaders = DTR_READERS;
const char kPython[] = "/usr/bin/python3";  // Debian's, which has Debian's modules

Eigen::Vector3d PointOf(const Json& list, size_t from = 0) {
  return {list[from].get<double>(), list[from + 1].get<double>(), list[from + 2].get<double>()};
}

Eigen::Vector3d NormalOf(const Json& fields, size_t i) {
  return {fields["nx"][i].get<double>(), fields["ny"][i].get<double>(),
          fields["nz"][i].get<double>()};
}

class ReadBack : public ExactExport {
 protected:
  // All that a program prints. It must end well.
  std::string Printed(const std::vector<std::string>& words) const {
    ProcessOptions options;
    options.log_file = folder_ / "printed";
    const bool ok = RunProcess(words, options).Ok();
    const std::string text = ReadFile(options.log_file, 1 << 28);
    EXPECT_TRUE(ok) << text.substr(0, 2000);
    return text;
  }
  // The last line of it, JSON.
  Json Found(const std::vector<std::string>& words) const {
    std::string last;
    std::istringstream lines(Printed(words));
    for (std::string line; std::getline(lines, line);) last = line;
    return Json::parse(last);
  }
  static bool HasPython(const std::string& modules) {
    return fs::exists(kPython) && RunProcess({kPython, "-c", "import " + modules}, {}).Ok();
  }
  static bool HasNpm(const std::string& module) {
    const char* folder = std::getenv("DTR_PLAYWRIGHT");
    return folder != nullptr && fs::exists(fs::path(folder) / "node_modules" / module);
  }
  static std::string Reader(const char* name) { return (kReaders / name).string(); }
  std::string Name(const char* name) const { return (folder_ / name).string(); }

  // The view sees the point at the pixel (the centre of the first is 0.5).
  static void ExpectSeenAt(const View& view, const Json& pixel, const Eigen::Vector3d& p) {
    const auto seen = view.camera.PixelFromCam(view.cam_from_world * p);
    ASSERT_TRUE(seen);
    EXPECT_LT((*seen - Eigen::Vector2d(pixel[0].get<double>(), pixel[1].get<double>())).norm(),
              kResidualPx);
  }
};

TEST_F(ReadBack, CopcReadsLas) {
  if (!HasNpm("copc")) GTEST_SKIP() << "needs copc below DTR_PLAYWRIGHT";
  ExactSetOptions options;
  options.world_origin = {500000, 4500000.25, 100};
  Make(options);
  pipeline::ExportPly(Request("cloud.ply"), noted_);
  const size_t points = pipeline::ExportLas(Request("cloud.las"), noted_).points;
  const Ply ply = ReadPly(folder_ / "cloud.ply");
  const Json found = Found({"node", Reader("read_las.mjs"), Name("cloud.las")});
  EXPECT_EQ(found["version"], "1.4");
  EXPECT_THAT(found["facts"].get<std::string>(), HasSubstr("validation"));
  ASSERT_EQ(found["count"], points);
  ASSERT_EQ(found["X"].size(), points);
  for (size_t i = 0; i < points; ++i) {
    const Eigen::Vector3d p(found["X"][i].get<double>(), found["Y"][i].get<double>(),
                            found["Z"][i].get<double>());
    ASSERT_LT(OffCentrePx(views_, p - options.world_origin), kResidualPx);
    for (size_t c = 0; c < 3; ++c) {
      EXPECT_GE(p[static_cast<int>(c)], found["min"][c]);
      EXPECT_LE(p[static_cast<int>(c)], found["max"][c]);
    }
    // Colours of 16 bits: 255 is 65535.
    EXPECT_EQ(found["Red"][i], 257 * ply["red"][i]);
    EXPECT_EQ(found["Blue"][i], 257 * ply["blue"][i]);
    EXPECT_EQ(found["UserData"][i], ply["views"][i]);
    EXPECT_FLOAT_EQ(found["sigma"][i], static_cast<float>(ply["sigma"][i]));
  }
}

TEST_F(ReadBack, MeshioReadsTheCloud) {
  if (!HasPython("meshio")) GTEST_SKIP() << "needs Debian's python3-meshio";
  ExactSetOptions options;
  options.world_origin = {500000, 4500000.25, 100};
  Make(options);
  const size_t points = pipeline::ExportPly(Request("cloud.ply"), noted_).points;
  const Json found = Found({kPython, Reader("read_ply.py"), Name("cloud.ply")});
  EXPECT_EQ(found["type"], "float64");
  ASSERT_EQ(found["points"].size(), points);
  const Json& fields = found["fields"];
  for (size_t i = 0; i < points; ++i) {
    const Eigen::Vector3d p = PointOf(found["points"][i]) - options.world_origin;
    ASSERT_LT(OffCentrePx(views_, p), kResidualPx);
    const Eigen::Vector3d normal = NormalOf(fields, i);
    EXPECT_NEAR(normal.norm(), 1, 1e-5);
    EXPECT_LT(normal.dot(p - views_[2].CenterInWorld()), 0) << "it points to the cameras";
    EXPECT_GT(fields["sigma"][i], 0);
    EXPECT_GE(fields["views"][i], 2);
    EXPECT_LE(fields["views"][i], 5);
  }
}

TEST_F(ReadBack, MeshioReadsTheMesh) {
  if (!HasPython("meshio")) GTEST_SKIP() << "needs Debian's python3-meshio";
  Make({});
  const pipeline::ExportReport report = pipeline::ExportMesh(Request("mesh.ply"), noted_);
  const Json found = Found({kPython, Reader("read_ply.py"), Name("mesh.ply")});
  ASSERT_EQ(found["points"].size(), report.points);
  ASSERT_EQ(found["triangles"].size(), report.triangles);
  // Triangles turn as their normals say.
  const Json& fields = found["fields"];
  size_t agreeing = 0;
  for (const Json& triangle : found["triangles"]) {
    const size_t a = triangle[0], b = triangle[1], c = triangle[2];
    const Eigen::Vector3d pa = PointOf(found["points"][a]), pb = PointOf(found["points"][b]),
                          pc = PointOf(found["points"][c]);
    const Eigen::Vector3d normal = NormalOf(fields, a);
    agreeing += (pb - pa).cross(pc - pa).dot(normal) > 0 ? 1 : 0;
  }
  EXPECT_GT(agreeing, report.triangles * 99 / 100);
}

TEST_F(ReadBack, AssimpReadsTheMesh) {
  const std::string assimp = FindProgram("assimp").string();
  if (assimp.empty()) GTEST_SKIP() << "needs assimp (Debian: assimp-utils)";
  Make({});
  const pipeline::ExportReport report = pipeline::ExportMesh(Request("mesh.ply"), noted_);
  pipeline::ExportMesh(Request("mesh.glb"), noted_);
  for (const char* name : {"mesh.ply", "mesh.glb"}) {
    // --raw: as the file has it.
    std::istringstream words(Printed({assimp, "info", Name(name), "--raw"}));
    std::string text, word;
    for (; words >> word;) text += word + " ";
    EXPECT_THAT(text, HasSubstr("Faces: " + std::to_string(report.triangles) + " ")) << name;
  }
}

// What Khronos' validator finds wrong or doubtful, but for `known`.
std::vector<std::string> Complaints(const Json& found, const std::vector<std::string>& known) {
  std::vector<std::string> complaints;
  for (const Json& message : found["messages"]) {
    const std::string code = message["code"];
    constexpr int kWarning = 1;  // 0: error, 2: information
    if (message["severity"] > kWarning) continue;
    if (std::find(known.begin(), known.end(), code) == known.end()) complaints.push_back(code);
  }
  return complaints;
}

TEST_F(ReadBack, ThreeJsReadsTheMesh) {
  if (!HasNpm("three") || !HasNpm("gltf-validator")) {
    GTEST_SKIP() << "needs three and gltf-validator below DTR_PLAYWRIGHT";
  }
  Make({});
  pipeline::ExportMesh(Request("mesh.ply"), noted_);
  const pipeline::ExportReport report = pipeline::ExportMesh(Request("mesh.glb"), noted_);
  const Ply ply = ReadPly(folder_ / "mesh.ply");
  const Json found = Found({"node", Reader("read_glb.mjs"), Name("mesh.glb")});
  EXPECT_THAT(Complaints(found, {}), IsEmpty());
  ASSERT_EQ(found["objects"].size(), 1u);
  const Json& mesh = found["objects"][0];
  EXPECT_EQ(mesh["type"], "Mesh");
  ASSERT_EQ(mesh["index"].size(), 3 * report.triangles);
  const Json& position = mesh["attributes"]["position"]["values"];
  const Json& colour = mesh["attributes"]["color"];
  const size_t channels = colour["itemSize"];
  ASSERT_EQ(position.size(), 3 * ply.count);
  for (size_t i = 0; i < ply.count; ++i) {
    const Eigen::Vector3d p(ply["x"][i], ply["y"][i], ply["z"][i]);
    // Turned, so lengths alone are the same; where they are turned to, the test of splats says.
    EXPECT_NEAR(PointOf(position, 3 * i).norm() / p.norm(), 1, 1e-5);
    const double linear = colour["values"][channels * i], srgb = ply["red"][i] / 255;
    const double decoded = srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
    EXPECT_NEAR(linear, decoded, 1e-4);
  }
}

// https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Khronos/KHR_gaussian_splatting:
// each MUST of its text that a file can break.
TEST_F(ReadBack, SplatsAreAsTheirExtensionAsks) {
  if (!HasNpm("three") || !HasNpm("gltf-validator")) {
    GTEST_SKIP() << "needs three and gltf-validator below DTR_PLAYWRIGHT";
  }
  Make({});
  const size_t count = pipeline::ExportSplat(Request("splats.glb"), noted_).points;
  const Json found = Found({"node", Reader("read_glb.mjs"), Name("splats.glb")});
  // The validator does not know the extension, so neither its attributes.
  EXPECT_THAT(Complaints(found, {"MESH_PRIMITIVE_INVALID_ATTRIBUTE", "UNSUPPORTED_EXTENSION"}),
              IsEmpty());
  const Json& json = found["json"];
  const std::string name = "KHR_gaussian_splatting";
  EXPECT_THAT(json["extensionsUsed"].get<std::vector<std::string>>(), ::testing::Contains(name));
  const Json& primitive = json["meshes"][0]["primitives"][0];
  EXPECT_EQ(primitive["mode"], 0) << "POINTS";
  const Json& extension = primitive["extensions"][name];
  EXPECT_EQ(extension["kernel"], "ellipse");
  EXPECT_EQ(extension["colorSpace"], "srgb_rec709_display");
  EXPECT_EQ(extension.value("projection", "perspective"), "perspective");
  EXPECT_EQ(extension.value("sortingMethod", "cameraDistance"), "cameraDistance");

  const auto accessor = [&](const std::string& attribute, const char* type) {
    const Json& of = json["accessors"][primitive["attributes"].at(attribute).get<size_t>()];
    EXPECT_EQ(of["type"], type) << attribute;
    EXPECT_EQ(of["componentType"], 5126) << attribute << ": floats";
    EXPECT_EQ(of["count"], count) << attribute;
  };
  accessor("POSITION", "VEC3");
  accessor(name + ":ROTATION", "VEC4");
  accessor(name + ":SCALE", "VEC3");
  accessor(name + ":OPACITY", "SCALAR");
  accessor(name + ":SH_DEGREE_0_COEF_0", "VEC3");

  ASSERT_EQ(found["objects"].size(), 1u);
  EXPECT_EQ(found["objects"][0]["type"], "Points");
  const Json& attributes = found["objects"][0]["attributes"];
  const auto values = [&](std::string attribute) -> const Json& {
    // three.js has names in small letters.
    std::transform(attribute.begin(), attribute.end(), attribute.begin(), ::tolower);
    return attributes.at(attribute)["values"];
  };
  const Json &rotation = values(name + ":ROTATION"), &scale = values(name + ":SCALE"),
             &opacity = values(name + ":OPACITY"),
             &harmonics = values(name + ":SH_DEGREE_0_COEF_0");
  const Json* colour = attributes.contains("color") ? &attributes["color"] : nullptr;
  ASSERT_NE(colour, nullptr) << "COLOR_0, for viewers that show points";
  const size_t channels = (*colour)["itemSize"];
  ASSERT_EQ(channels, 4u);
  constexpr double kHalfStep = 0.501 / 255;  // it has 8 bits
  for (size_t i = 0; i < count; ++i) {
    double norm = 0;
    for (size_t k = 0; k < 4; ++k) norm += std::pow(rotation[4 * i + k].get<double>(), 2);
    EXPECT_NEAR(norm, 1, 1e-5) << "a unit quaternion";
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_GE(scale[3 * i + k], 0);
      // COLOR_0: the diffuse colour, clamped and decoded from sRGB.
      const double srgb =
          std::clamp(harmonics[3 * i + k].get<double>() * 0.2820947917738781 + 0.5, 0.0, 1.0);
      const double linear = srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
      EXPECT_NEAR((*colour)["values"][4 * i + k], linear, kHalfStep);
    }
    EXPECT_GE(opacity[i], 0);
    EXPECT_LE(opacity[i], 1);
    EXPECT_NEAR((*colour)["values"][4 * i + 3], opacity[i], kHalfStep);
  }
}

TEST_F(ReadBack, ColmapReadsItsFolder) {
  const std::string colmap = FindProgram("colmap").string();
  if (colmap.empty()) GTEST_SKIP() << "needs colmap";
  Make({});
  const pipeline::ExportReport report = pipeline::ExportColmap(Request("colmap"), noted_);
  const std::string model = Name("colmap/sparse/0");
  const std::string analysed = Printed({colmap, "model_analyzer", "--path", model});
  EXPECT_THAT(analysed, HasSubstr("Images: " + std::to_string(report.images)));
  EXPECT_THAT(analysed, HasSubstr("Points: " + std::to_string(report.points)));
  fs::create_directory(folder_ / "text");
  Printed({colmap, "model_converter", "--input_path", model, "--output_path", Name("text"),
           "--output_type", "TXT"});
  // COLMAP's own text: https://colmap.github.io/format.html.
  std::map<int, std::vector<double>> cameras;
  std::istringstream camera_lines(ReadFile(folder_ / "text/cameras.txt", 1 << 20));
  for (std::string line; std::getline(camera_lines, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    int id = 0, width = 0, height = 0;
    std::string kind;
    words >> id >> kind >> width >> height;
    EXPECT_EQ(kind, "PINHOLE");
    EXPECT_EQ(width, 96);
    EXPECT_EQ(height, 72);
    for (double value; words >> value;) cameras[id].push_back(value);
    ASSERT_EQ(cameras[id].size(), 4u);
  }
  std::istringstream image_lines(ReadFile(folder_ / "text/images.txt", 1 << 26));
  size_t images = 0;
  for (std::string line; std::getline(image_lines, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    int id = 0, camera = 0;
    Eigen::Quaterniond q;
    Eigen::Vector3d t;
    std::string name;
    words >> id >> q.w() >> q.x() >> q.y() >> q.z() >> t.x() >> t.y() >> t.z() >> camera;
    std::getline(words >> std::ws, name);
    const View* view = nullptr;
    for (const View& of : views_) {
      if (fs::path(of.name).stem() == fs::path(name).stem()) view = &of;
    }
    ASSERT_NE(view, nullptr) << name;
    EXPECT_TRUE(fs::exists(folder_ / "colmap/images" / name));
    const std::vector<double>& k = cameras.at(camera);
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0, 0, 9), Eigen::Vector3d(1, -1, 7)}) {
      const Eigen::Vector3d in_cam = q * p + t;
      ExpectSeenAt(
          *view, {k[0] * in_cam.x() / in_cam.z() + k[2], k[1] * in_cam.y() / in_cam.z() + k[3]}, p);
    }
    ++images;
    std::getline(image_lines, line);  // its observations
  }
  EXPECT_EQ(images, views_.size());
}

// Which COLMAP itself reads up to the first blank.
TEST_F(ReadBack, NamesInColmapsTextFilesHaveNoBlanks) {
  views_ = ExactViews({});
  views_[0].name = "one two.png";
  views_[1].name = "one_two.png";
  WriteExactSet(folder_ / "set.dtr", views_, {});
  pipeline::ExportRequest request = Request("colmap");
  request.text = true;
  pipeline::ExportColmap(request, noted_);
  std::istringstream lines(ReadFile(folder_ / "colmap/sparse/0/images.txt", 1 << 26));
  std::set<std::string> names;
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    std::string word, name;
    for (int k = 0; k < 9; ++k) words >> word;
    EXPECT_TRUE(words >> name);
    EXPECT_FALSE(words >> word) << line;
    EXPECT_TRUE(fs::exists(folder_ / "colmap/images" / name)) << name;
    names.insert(name);
    std::getline(lines, line);  // its observations
  }
  EXPECT_EQ(names.size(), views_.size());
  EXPECT_TRUE(names.contains("one_two.png") && names.contains("one_two-2.png"));
}

TEST_F(ReadBack, OpenExrReadsDepth) {
  const std::string header = FindProgram("exrheader").string(),
                    tool = FindProgram("oiiotool").string();
  if (header.empty() || tool.empty()) {
    GTEST_SKIP() << "needs exrheader and oiiotool (Debian: openexr, openimageio-tools)";
  }
  Make({});
  pipeline::ExportDepth(Request("depth"), noted_);
  const std::string file = Name("depth/depth/left/photo 1.exr");
  EXPECT_THAT(Printed({header, file}), HasSubstr("Y, 32-bit floating-point"));
  std::istringstream lines(Printed({tool, "--dumpdata", file}));
  int pixels = 0;
  for (std::string line; std::getline(lines, line);) {
    int x = 0, y = 0;
    double z = 0;
    if (std::sscanf(line.c_str(), " Pixel (%d, %d): %lf", &x, &y, &z) != 3) continue;
    EXPECT_NEAR(z, views_[1].depth(x, y), 1e-5 * z);
    ++pixels;
  }
  EXPECT_EQ(pixels, 96 * 72);
}

TEST_F(ReadBack, ASmallReaderReadsNerfstudiosFolder) {
  if (!HasPython("meshio, numpy, OpenImageIO")) {
    GTEST_SKIP() << "needs Debian's python3-meshio and python3-openimageio";
  }
  MakeWithHeldOut({});
  const pipeline::ExportReport report = pipeline::ExportNerfstudio(Request("nerf"), noted_);
  const Json found = Found({kPython, Reader("read_nerfstudio.py"), Name("nerf")});
  ASSERT_EQ(found["frames"].size(), views_.size());
  EXPECT_EQ(found["cloud"].size(), report.points);
  size_t pixels = 0;
  for (size_t v = 0; v < views_.size(); ++v) {
    const Json& frame = found["frames"][v];
    EXPECT_EQ(frame["points"].empty(), v == 3) << "view 3 is held out";
    for (size_t i = 0; i < frame["points"].size(); ++i, ++pixels) {
      ExpectSeenAt(views_[v], frame["pixels"][i], PointOf(frame["points"][i]));
    }
  }
  EXPECT_GT(pixels, 1000u);
}

TEST_F(ReadBack, OpenMvsHeaderReadsItsFolder) {
  const char* source = std::getenv("DTR_OPENMVS");
  const fs::path header = fs::path(source == nullptr ? "" : source) / "libs/MVS/Interface.h";
  if (source == nullptr || !fs::exists(header))
    GTEST_SKIP() << "needs DTR_OPENMVS, OpenMVS' source";
  MakeWithHeldOut({});
  const size_t points = pipeline::ExportOpenmvs(Request("mvs"), noted_).points;
  const std::string program = Name("read_openmvs");
  Printed({"c++", "-std=c++17", "-w", "-I" + header.parent_path().string(),
           "-I/usr/include/opencv4", Reader("read_openmvs.cpp"), "-lopencv_core", "-o", program});
  const Json found = Found({program, Name("mvs")});
  const std::vector<size_t> sources = {0, 1, 2, 4};
  ASSERT_EQ(found["images"].size(), sources.size());
  ASSERT_EQ(found["vertices"].size(), points);
  for (const Json& vertex : found["vertices"]) {
    for (const Json& seen : vertex["seen"]) {
      ExpectSeenAt(views_[sources[seen[0]]], {seen[1], seen[2]}, PointOf(vertex["point"]));
    }
  }
  for (size_t i = 0; i < sources.size(); ++i) {
    const Json& depth = found["depth"][i];
    EXPECT_EQ(depth["known"], 1);
    EXPECT_EQ(depth["whole"], 1);
    EXPECT_EQ(depth["image"], i);
    EXPECT_GT(depth["points"].size(), 1000u);
    for (const Json& p : depth["points"]) ExpectSeenAt(views_[sources[i]], p, PointOf(p, 2));
  }
}

TEST_F(ReadBack, TmivsReaderReadsItsFolder) {
  const char* folder = std::getenv("DTR_TMIV");
  if (folder == nullptr || !fs::exists(fs::path(folder) / "source/MivBitstream")) {
    GTEST_SKIP() << "needs DTR_TMIV, TMIV's source";
  }
  MakeWithHeldOut({});
  pipeline::ExportMiv(Request("miv"), noted_);
  const std::string source = (fs::path(folder) / "source").string(), program = Name("read_tmiv");
  std::vector<std::string> compile = {"c++", "-std=c++17", "-w", "-ffunction-sections",
                                      "-Wl,--gc-sections"};
  for (const char* module : {"Common", "MivBitstream", "Renderer"}) {
    compile.push_back("-I" + source + "/" + module + "/include");
  }
  compile.push_back(Reader("read_tmiv.cpp"));
  for (const char* file :
       {"Common/src/Json", "Common/src/verify", "MivBitstream/src/SequenceConfig",
        "MivBitstream/src/ViewParamsList", "MivBitstream/src/CommonAtlasFrameMivExtension",
        "MivBitstream/src/DepthOccupancyTransform"}) {
    compile.push_back(source + "/" + file + ".cpp");
  }
  compile.insert(compile.end(), {"-lfmt", "-o", program});
  Printed(compile);
  const Json found = Found({program, Name("miv")});
  EXPECT_EQ(found["frames"], 1);
  const std::vector<size_t> sources = {0, 1, 2, 4};
  ASSERT_EQ(found["cameras"].size(), sources.size());
  for (size_t i = 0; i < sources.size(); ++i) {
    const Json& camera = found["cameras"][i];
    EXPECT_EQ(camera["occupancy"], 1);
    for (const char* plane : {"depth_bytes", "texture_bytes"}) {
      EXPECT_EQ(camera[plane], 96 * 72 * 3) << plane << ": 4:2:0, two bytes each";
    }
    EXPECT_GT(camera["points"].size(), 1000u);
    for (const Json& p : camera["points"]) {
      const Eigen::Vector3d q = PointOf(p, 2);  // x forward, y left, z up
      ExpectSeenAt(views_[sources[i]], p, {-q.y(), -q.z(), q.x()});
    }
  }
}

}  // namespace
}  // namespace dtr::testing
