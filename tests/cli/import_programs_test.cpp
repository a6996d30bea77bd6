// Files as the programs of today write them, in the ways of each: cases of shared/data/field and
// their kin.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "calib/colmap/model_io.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "dtr/types/area_average.h"
#include "tests/cli/field_scene.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// Median distance of the set's points, as its cameras see them, from where its photos show them.
double MedianResidualPx(const DtrSet& set, const SparseScene& scene) {
  std::vector<double> residuals;
  for (const SparseObservation& seen : scene.observations) {
    const View& view = set.frames[0].views[static_cast<size_t>(seen.view)];
    const auto pixel = view.camera.PixelFromCam(
        view.cam_from_world * scene.points[static_cast<size_t>(seen.point)].p_in_world);
    residuals.push_back(pixel ? (*pixel - seen.pixel).norm() : INFINITY);
  }
  if (residuals.empty()) return INFINITY;
  const auto middle = residuals.begin() + static_cast<long>(residuals.size() / 2);
  std::nth_element(residuals.begin(), middle, residuals.end());
  return *middle;
}

class ImportPrograms : public FieldScene {
 protected:
  void Imports(const fs::path& cameras, const fs::path& images,
               std::vector<std::string> further = {}) {
    std::vector<std::string> args = {
        "import", "--cameras", cameras.string(), "-o",
        Set(),    "--force",   "--json",         (folder_ / "result.json").string()};
    if (!images.empty()) args.insert(args.end(), {"--images", images.string()});
    args.insert(args.end(), further.begin(), further.end());
    DtrOk(args);
  }
  // Photos of the scene, shrunk.
  fs::path Shrunk(int times) const {
    const fs::path folder = folder_ / fmt::format("images_{}", times);
    fs::create_directories(folder);
    for (int i = 0; i < 6; ++i) {
      const std::string name = fmt::format("frame_0000{}.jpg", i);
      const ImageRgb8 photo = io::ReadImage(Field("_scene/images") / name);
      io::WriteImage(folder / name,
                     AreaAverage(photo, photo.width() / times, photo.height() / times));
    }
    return folder;
  }
};

TEST_F(ImportPrograms, AnNvmOfColmapFitsItsPoints) {
  const fs::path folder = Field("colmap_nvm");
  DTR_REQUIRE_DATA(folder);
  Imports(folder / "colmap.nvm", folder / "photos");
  EXPECT_THAT(Notes(),
              AllOf(HasSubstr("pixels from the image's corner"), HasSubstr("as COLMAP writes it"),
                    Not(HasSubstr("matched features lie"))));
  const DtrSet set = io::LoadSet(Set());
  ASSERT_EQ(set.frames[0].views.size(), 6u);
  constexpr double kMaxPx = 0.4;  // the model's own noise; from the middle they are 254 px off
  EXPECT_LT(MedianResidualPx(set, io::LoadSparse(Set(), set)), kMaxPx);
  const Ran valid = Dtr({"validate", Set()});
  EXPECT_THAT(valid.out, Not(HasSubstr("FAILED"))) << valid.out;
}

TEST_F(ImportPrograms, AnNvmOfVisualSfmMayLackItsLastLineEnd) {
  const fs::path file = Field("nvm_last_line") / "visualsfm.nvm";
  DTR_REQUIRE_DATA(file);
  Imports(file, Field("colmap_nvm") / "photos");
  EXPECT_EQ(Result()["views"], 6);
}

TEST_F(ImportPrograms, ACaptureOfTodaysStrayScannerIsRead) {
  const fs::path folder = Field("stray_odometry_columns") / "capture";
  DTR_REQUIRE_DATA(folder);
  Imports(folder, "");
  const DtrSet set = io::LoadSet(Set());
  ASSERT_EQ(set.frames[0].views.size(), 4u);
  EXPECT_EQ(set.unit, LengthUnit::kMetre);
  for (const View& view : set.frames[0].views) {
    EXPECT_NEAR(view.camera.fx_px(), 298.67, 0.01);
    EXPECT_FALSE(view.depth.empty());
  }
}

TEST_F(ImportPrograms, MetashapesGeocentricCamerasAreInMetres) {
  const fs::path folder = Field("metashape_wgs84");
  DTR_REQUIRE_DATA(folder);
  Imports(folder / "cameras.xml", folder / "photos",
          {"--depth", (folder / "depth").string(), "--depth-kind", "z", "--depth-unit", "1",
           "--no-completion"});
  EXPECT_EQ(io::ReadSet(Set()).unit, LengthUnit::kMetre);
}

TEST_F(ImportPrograms, AFileThatStatesNoUnitHasNone) {
  DtrOk(Import(Field("_scene") / "transforms_dfull.json"));
  EXPECT_EQ(io::ReadSet(Set()).unit, LengthUnit::kUnknown);
  Imports(Field("_scene/c_plain"), Field("_scene/images"));
  EXPECT_EQ(io::ReadSet(Set()).unit, LengthUnit::kUnknown);
}

TEST_F(ImportPrograms, AFullSizeModelIsScaledToPhotosOfImages2And4) {
  for (const int times : {2, 4}) {
    const fs::path photos = Shrunk(times);
    Imports(Field("_scene/c_plain"), photos);
    EXPECT_THAT(Notes(), HasSubstr(fmt::format("its cameras are of images of 480x360, "
                                               "frame_00000.jpg has {}x{}: scaled by {} (6 of 6",
                                               480 / times, 360 / times, 1.0 / times)));
    const DtrSet set = io::LoadSet(Set());
    ASSERT_EQ(set.frames[0].views.size(), 6u);
    EXPECT_NEAR(set.frames[0].views[0].camera.fx_px(), 420.0 / times, 1e-9);
    EXPECT_LT(MedianResidualPx(set, io::LoadSparse(Set(), set)), 1.0 / times);
    const Ran built =
        DtrOk({"build", photos.string(), "--poses", Field("_scene/c_plain").string(), "--engine",
               "none", "--force", "-o", (folder_ / "built.dtr").string()});
    EXPECT_THAT(built.err, HasSubstr(fmt::format("scaled by {}", 1.0 / times)));
    EXPECT_NEAR(io::ReadSet((folder_ / "built.dtr").string()).frames[0].views[0].camera.fx_px(),
                420.0 / times, 1e-9);
  }
}

TEST_F(ImportPrograms, PhotosThatWereCroppedAreStillRejected) {
  const fs::path photos = folder_ / "cropped";
  fs::create_directories(photos);
  for (int i = 0; i < 6; ++i) {
    const std::string name = fmt::format("frame_0000{}.jpg", i);
    const ImageRgb8 photo = io::ReadImage(Field("_scene/images") / name);
    ImageRgb8 cropped(photo.width() - 40, photo.height(), 3);
    for (int y = 0; y < cropped.height(); ++y) {
      for (int x = 0; x < cropped.width(); ++x) {
        for (int c = 0; c < 3; ++c) cropped(x, y, c) = photo(x + 20, y, c);
      }
    }
    io::WriteImage(photos / name, cropped);
  }
  ExpectRejected(Dtr({"import", "--cameras", Field("_scene/c_plain").string(), "--images",
                      photos.string(), "-o", Set()}),
                 kFailed, "pixels as the camera says");
}

// COLMAP 3.12 and later: frames hold the poses, images.txt may be older.
TEST_F(ImportPrograms, PosesOfFramesGoBeforeThoseOfAnOlderImagesFile) {
  const calib::SfmModel truth = colmap::ReadModel(Field("_scene/c_plain"));
  calib::SfmModel older = truth;
  std::string frames;
  for (calib::SfmImage& image : older.images) {
    const auto& q = image.cam_from_world.rotation;
    const auto& t = image.cam_from_world.translation;
    frames += fmt::format("{} 1 {} {} {} {} {} {} {} 1 CAMERA {} {}\n", image.id, q.w(), q.x(),
                          q.y(), q.z(), t.x(), t.y(), t.z(), image.camera_id, image.id);
    image.cam_from_world.translation.y() += 0.7;
  }
  colmap::WriteModel(folder_ / "model", older, colmap::Format::kText);
  const std::uint32_t camera = truth.images.front().camera_id;
  std::ofstream(folder_ / "model/rigs.txt") << fmt::format("1 1 CAMERA {}\n", camera);
  std::ofstream(folder_ / "model/frames.txt") << frames;
  Imports(folder_ / "model", Field("_scene/images"));
  EXPECT_THAT(Notes(), AllOf(HasSubstr("frames.txt: 6 of 6 images have another pose"),
                             HasSubstr("0.7 units")));
  const DtrSet set = io::LoadSet(Set());
  for (size_t i = 0; i < truth.images.size(); ++i) {
    const View& view = set.frames[0].views[i];
    EXPECT_LT((view.cam_from_world.TargetOriginInSource() + set.world_origin -
               truth.images[i].cam_from_world.TargetOriginInSource())
                  .norm(),
              1e-9);
  }
  const Ran built =
      DtrOk({"build", Field("_scene/images").string(), "--poses", (folder_ / "model").string(),
             "--engine", "none", "-o", (folder_ / "built.dtr").string()});
  EXPECT_THAT(built.err, HasSubstr("those of frames.txt are used"));
}

TEST_F(ImportPrograms, ACaptureOf3dScannerAppIsRead) {
  const fs::path folder = DataFolder() / "lidar_3dscanner_chair";
  DTR_REQUIRE_DATA(folder);
  DtrOk({"import", folder.string(), "--no-completion", "-o", Set(), "--json",
         (folder_ / "result.json").string()});
  EXPECT_THAT(Notes(), HasSubstr("depth of the lowest confidence is left out"));
  const DtrSet set = io::LoadSet(Set());
  ASSERT_EQ(set.frames[0].views.size(), 24u);
  EXPECT_EQ(set.unit, LengthUnit::kMetre);
  // info.json has 1447.65 px for 1920x1440; photos are half that.
  EXPECT_NEAR(set.frames[0].views[1].camera.fx_px(), 1447.649 / 2, 0.01);
}

}  // namespace
}  // namespace dtr::testing
