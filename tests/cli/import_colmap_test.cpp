// `dtr import` and `dtr build --poses` where points must be triangulated, which COLMAP does.
#include "dtr/base/process.h"
#include "dtr/io/set_io.h"
#include "tests/cli/field_scene.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST_F(FieldScene, DepthMapsThatNobodyAskedForAreNamed) {
  DtrOk({"import", "--cameras", Field("_scene/transforms_dfull.json").string(), "--images",
         Field("_scene").string(), "-o", Set(), "--json", (folder_ / "result.json").string()});
  EXPECT_THAT(Notes(),
              HasSubstr("6 depth maps that it names are not used; --depth DIR takes them"));
}

TEST_F(FieldScene, PosesWithoutPointsGetThemTriangulated) {
  DtrOk({"import", "--cameras", Field("_scene/transforms_ply.json").string(), "--images",
         Field("_scene").string(), "-o", Set(), "--json", (folder_ / "result.json").string()});
  EXPECT_THAT(Notes(), AllOf(HasSubstr("points of sparse_pc.ply are not used"),
                             HasSubstr("fields that are not used: applied_transform"),
                             HasSubstr("triangulated")));
  const DtrSet set = io::ReadSet(Set());
  EXPECT_EQ(set.frames[0].views.size(), 6u);
  EXPECT_GT(io::LoadSparse(Set(), set).points.size(), 50u);
}

TEST_F(FieldScene, BuildAndRenderReadATransformsJson) {
  const std::string file = Field("_scene/transforms_dfull.json").string();
  DtrOk(
      {"build", Field("_scene/images").string(), "--poses", file, "--engine", "none", "-o", Set()});
  EXPECT_EQ(io::ReadSet(Set()).frames[0].views.size(), 6u);
  DtrOk(Import(file));
  DtrOk({"render", Set(), "--path", file, "--renderer", "cpu", "--size", "120x90", "-o",
         (folder_ / "frames").string()});
  EXPECT_EQ(FilesIn(folder_ / "frames"), 6);
}

TEST_F(FieldScene, ColmapReadsWhatIsExported) {
  DtrOk(Import(Field("_scene/transforms_dfull.json")));
  DtrOk({"export", Set(), "-o", (folder_ / "out").string()});
  const fs::path log = folder_ / "analyzer.log";
  ProcessOptions logged;
  logged.log_file = log;
  const std::string model = (folder_ / "out/sparse/0").string();
  ASSERT_TRUE(RunProcess({"colmap", "model_analyzer", "--path", model}, logged).Ok());
  EXPECT_THAT(Text(log), HasSubstr("Registered images: 6"));
  fs::create_directory(folder_ / "text");
  ASSERT_TRUE(
      RunProcess({"colmap", "model_converter", "--input_path", (folder_ / "out/sparse/0").string(),
                  "--output_path", (folder_ / "text").string(), "--output_type", "TXT"},
                 {})
          .Ok());
  const std::string again = (folder_ / "again.dtr").string();
  DtrOk({"import", "--cameras", (folder_ / "text").string(), "--images",
         (folder_ / "out/images").string(), "-o", again});
  EXPECT_EQ(io::ReadSet(again).frames[0].views.size(), 6u);
}

// What COLMAP writes for other programs says the same as its model.
TEST_F(FieldScene, NvmAndBundlerFilesOfColmapGiveTheCamerasOfItsModel) {
  const std::string images = Field("_scene/images").string();
  const auto imported = [&](const fs::path& cameras) {
    DtrOk({"import", "--cameras", cameras.string(), "--images", images, "--force", "-o", Set(),
           "--json", (folder_ / "result.json").string()});
    EXPECT_THAT(Notes(), Not(HasSubstr("matched features lie")));
    return io::ReadSet(Set());
  };
  const DtrSet truth = imported(Field("_scene/c_plain"));
  const std::pair<const char*, const char*> kinds[] = {{"NVM", "scene.nvm"},
                                                       {"Bundler", "scene.bundle.out"}};
  for (const auto& [kind, file] : kinds) {
    const fs::path output = folder_ / (std::string(kind) == "NVM" ? "scene.nvm" : "scene");
    ASSERT_TRUE(
        RunProcess({"colmap", "model_converter", "--input_path", Field("_scene/c_plain").string(),
                    "--output_path", output.string(), "--output_type", kind},
                   {})
            .Ok());
    const DtrSet set = imported(folder_ / file);
    ASSERT_EQ(set.frames[0].views.size(), truth.frames[0].views.size());
    for (size_t i = 0; i < truth.frames[0].views.size(); ++i) {
      const View &view = set.frames[0].views[i], &expected = truth.frames[0].views[i];
      EXPECT_NEAR(view.camera.fx_px(), expected.camera.fx_px(), 1e-9);
      EXPECT_LT(view.cam_from_world.rotation.angularDistance(expected.cam_from_world.rotation),
                1e-9);
      EXPECT_LT((view.cam_from_world.translation - expected.cam_from_world.translation).norm(),
                1e-9);
    }
  }
}

}  // namespace
}  // namespace dtr::testing
