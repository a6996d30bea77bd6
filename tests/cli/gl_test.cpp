// What `dtr` says where OpenGL cannot do the job, and `dtr bench`.
#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "tests/support/environment.h"
#include "tests/support/small_courtyard_set.h"
#include "tests/support/virtual_display.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr size_t kMaxShaderBytes = 1 << 20;

class OpenGl : public SmallCourtyardSet {
 protected:
  Ran Render(std::vector<std::string> further = {}) {
    further.insert(further.begin(), {"render", Set(), "--like", "0001", "-o", In("v.png"), "--size",
                                     "60x0", "--force"});
    return Dtr(further);
  }
  /// Only a machine without OpenGL has none: every other failure is one.
  bool HasOpenGl() {
    const Ran ran = Render({"--renderer", "gl"});
    if (ran.code == 0) return true;
    EXPECT_THAT(ran.err, HasSubstr("OpenGL: expected a context of version 4.3"));
    return false;
  }
};

TEST_F(OpenGl, AMachineWithoutItIsToldInOneLine) {
  const Environment no_driver("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent");
  for (const char* command : {"render", "evaluate", "bench"}) {
    std::vector<std::string> args{command, Set(), "--renderer", "gl"};
    if (std::string(command) == "render") {
      args.insert(args.end(), {"--like", "0001", "-o", In("v.png")});
    }
    const Ran ran = Dtr(args);
    ExpectRejected(ran, kFailed,
                   "OpenGL: expected a context of version 4.3 or newer through EGL, found");
    EXPECT_THAT(ran.err, HasSubstr("; use --renderer cpu"));
  }
  EXPECT_FALSE(fs::exists(In("v.png")));
  EXPECT_EQ(Render({"--renderer", "cpu"}).code, 0);
}

TEST_F(OpenGl, AutoTakesSimdWithoutAGpuAndSaysSo) {
  const Environment no_driver("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent");
  const Ran deferred = Render({"--method", "deferred"});
  EXPECT_EQ(deferred.code, 0) << deferred.err;
  EXPECT_THAT(deferred.err, HasSubstr("renderer: simd ("));
  const std::string by_auto = Text(In("v.png"));
  const Ran named = Render({"--method", "deferred", "--renderer", "simd"});
  EXPECT_EQ(named.code, 0) << named.err;
  EXPECT_THAT(named.err, Not(HasSubstr("renderer:")));
  EXPECT_EQ(Text(In("v.png")), by_auto);

  const Ran two_pass = Render({"--method", "two-pass"});
  EXPECT_EQ(two_pass.code, 0) << two_pass.err;
  EXPECT_THAT(two_pass.err, HasSubstr("renderer: cpu for the two-pass method"));
  ExpectRejected(Render({"--method", "two-pass", "--renderer", "simd"}), kWrongUsage,
                 "--renderer simd: cannot draw by the two-pass method; use --method deferred");
}

TEST_F(OpenGl, AutoDrawsTwoPassesWithADriverOfTheProcessorWhereThereIsOne) {
  if (!HasOpenGl()) GTEST_SKIP() << "no OpenGL 4.3";
  const Ran ran = Render({"--method", "two-pass"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("renderer: gl ("));
}

TEST_F(OpenGl, NeedsNoDisplay) {
  if (!HasOpenGl()) GTEST_SKIP() << "no OpenGL 4.3";
  fs::remove(In("v.png"));
  const Environment no_x("DISPLAY", ""), no_wayland("WAYLAND_DISPLAY", "");
  const Ran ran = Render({"--renderer", "gl"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(io::ReadImage(In("v.png")).width(), 60);
}

TEST_F(OpenGl, OpenSceneGraphsTableSaysWhatItAdds) {
  const std::vector<std::string> arguments{
      "bench", Set(),       "--table", "osg",    "--views", "2",      "--resolution",
      "1",     "--repeats", "2",       "--size", "60x0",    "--json", "-"};
  {
    const Environment no_display("DISPLAY", "");
    const Ran refused = Dtr(arguments);
    if (refused.err.find("built with OpenSceneGraph") != std::string::npos) {
      GTEST_SKIP() << refused.err;
    }
    ExpectRejected(refused, kFailed, "expected a display for OpenSceneGraph's window, found none");
  }
  const VirtualDisplay display;
  if (!display.up()) GTEST_SKIP() << "no display: Xvfb is missing or did not come up";
  const Ran ran = Dtr(arguments);
  ASSERT_EQ(ran.code, 0) << ran.err;
  const Json json = Json::parse(ran.out);
  ASSERT_EQ(json["rows"].size(), 2U);
  EXPECT_EQ(json["rows"][0]["path"], "gpu");
  EXPECT_EQ(json["rows"][0]["views_used"], 2);
  EXPECT_GT(json["rows"][0]["gl_cpu_ms"], 0);
  EXPECT_GT(json["rows"][0]["seconds_per_frame"], 0);
  EXPECT_EQ(json["largest_ratio_osg_over_gl"], json["rows"][0]["ratio_osg_over_gl"]);
  EXPECT_EQ(json["rows"][1]["path"], "read-back");
  EXPECT_TRUE(json["rows"][1]["ratio_osg_over_gl"].is_null());
}

TEST_F(OpenGl, AnOlderContextIsToldInOneLine) {
  const Environment old("MESA_GL_VERSION_OVERRIDE", "3.3");
  ExpectRejected(Render({"--renderer", "gl"}), kFailed,
                 "OpenGL: expected a context of version 4.3 or newer through EGL, found");
}

TEST_F(OpenGl, ShadersComeFromAFolderWhereOneIsGiven) {
  if (!HasOpenGl()) GTEST_SKIP() << "no OpenGL 4.3";
  fs::copy("dtr/gl/shaders", In("shaders"));  // tests run in the root of the sources
  ASSERT_EQ(Render({"--renderer", "gl"}).code, 0);
  const std::string embedded = Text(In("v.png"));
  ASSERT_EQ(Render({"--shader-dir", In("shaders")}).code, 0);
  EXPECT_EQ(Text(In("v.png")), embedded);

  const std::string file = In("shaders/mesh.vert");
  WriteFileAtomically(file, "// one\nvoid main() { nothing = 1; }\n");
  const Ran broken = Render({"--method", "two-pass", "--shader-dir", In("shaders")});
  ExpectRejected(broken, kFailed, "shader mesh.vert:2: ");
  EXPECT_THAT(broken.err, HasSubstr("; use --renderer cpu"));
  fs::remove(file);
  ExpectRejected(Render({"--method", "two-pass", "--shader-dir", In("shaders")}), kFailed,
                 "mesh.vert: cannot be read");
  ExpectRejected(Render({"--shader-dir", In("absent")}), kWrongUsage,
                 "expected a folder of shaders such as dtr/gl/shaders, found none");
  ExpectRejected(Render({"--shader-dir", In("shaders"), "--renderer", "cpu"}), kWrongUsage,
                 "expected --renderer gl with it, found cpu");
}

TEST_F(OpenGl, AskingForSplatsPicksTheMethodThatHasThem) {
  if (!HasOpenGl()) GTEST_SKIP() << "no OpenGL 4.3";
  ASSERT_EQ(Render({"--primitive", "splat"}).code, 0);
  const std::string splats = Text(In("v.png"));
  ASSERT_EQ(Render({"--primitive", "splat", "--method", "two-pass"}).code, 0);
  EXPECT_EQ(Text(In("v.png")), splats);
  ASSERT_EQ(Render({"--method", "two-pass"}).code, 0);
  EXPECT_NE(Text(In("v.png")), splats);
}

TEST_F(OpenGl, BenchPrintsATableForPeopleAndOneForPrograms) {
  if (!HasOpenGl()) GTEST_SKIP() << "no OpenGL 4.3";
  for (const char* renderer : {"auto", "gl", "cpu"}) {
    const Ran ran = DtrOk({"bench", Set(), "--table", "report", "--size", "60x0", "--repeats", "1",
                           "--views", "2,3", "--cameras", "1", "--renderer", renderer, "--json",
                           In("bench.json"), "--force"});
    EXPECT_THAT(ran.out, HasSubstr("two-pass"));
    EXPECT_THAT(ran.out, HasSubstr("times as fast at 3 views and resolution 1"));
    const Json json = Json::parse(Text(In("bench.json")));
    ASSERT_EQ(json["rows"].size(), 8u);  // 2 resolutions x 2 numbers of views x 2 methods
    for (const Json& row : json["rows"]) {
      for (const char* name : {"method", "views_in_set", "views_used", "resolution", "ms", "fps",
                               "psnr_db", "cpu_ms", "spread_ms"}) {
        EXPECT_TRUE(row.contains(name)) << name;
      }
      EXPECT_GT(row["ms"], 0);
      EXPECT_GT(row["psnr_db"], 15);  // the two images are of one place
    }
    EXPECT_TRUE(json["ratio_two_pass_over_deferred"].is_number());
    EXPECT_TRUE(json["loss_db"].is_number());
    for (const char* name : {"cpu", "renderer", "version"}) EXPECT_NE(json["machine"][name], "");
  }
}

TEST_F(OpenGl, BenchPutsQualityAndCostOfEveryWeightSideBySide) {
  if (!HasOpenGl()) GTEST_SKIP() << "no OpenGL 4.3";
  const Ran ran = DtrOk({"bench", Set(), "--table", "weights", "--size", "40x0", "--repeats", "1",
                         "--views", "1,2", "--cameras", "1", "--json", In("weights.json")});
  EXPECT_THAT(ran.out, HasSubstr("inverse-angle"));
  const Json json = Json::parse(Text(In("weights.json")));
  EXPECT_EQ(json["table"], "weights");
  ASSERT_EQ(json["rows"].size(), 20u);  // 2 numbers of views x 5 weights x 2 methods
  for (const Json& row : json["rows"]) {
    EXPECT_GT(row["psnr_db"], 15);
    EXPECT_GT(row["cpu_ms"], 0);
  }
}

TEST_F(OpenGl, BenchMeasuresGrowth) {
  if (!HasOpenGl()) GTEST_SKIP() << "no OpenGL 4.3";
  const Ran ran = DtrOk({"bench", Set(), "--table", "growth", "--size", "40x0", "--repeats", "1",
                         "--views", "2", "--json", "-"});
  const Json json = Json::parse(ran.out);
  ASSERT_EQ(json["series"].size(), 3u);
  for (const Json& series : json["series"]) EXPECT_GE(series["rows"].size(), 2u);
}

TEST_F(OpenGl, BenchOfNothingOrOfWordsThatMeanNothing) {
  ExpectRejected(Dtr({"bench", Set(), "--table", "magic", "--renderer", "cpu"}), kWrongUsage,
                 "--table: magic not in {report,weights,growth,osg}");
  ExpectRejected(Dtr({"bench", In("absent.dtr"), "--renderer", "cpu"}), kFailed,
                 "expected the folder of a D+TR set, found nothing");
}

}  // namespace
}  // namespace dtr::testing
