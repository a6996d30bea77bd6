// Photos of every kind, and of two cameras, through COLMAP: their cameras come out as those of
// plain photos do. Photos with poses are in awkward_photos_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>

#include "calib/colmap/export.h"
#include "calib/colmap/model_io.h"
#include "calib/similarity.h"
#include "dtr/base/process.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/set_io.h"
#include "tests/cli/arc_photos.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/photo_kinds.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

void WritePlain(const fs::path& file, const ImageRgb8& image) { io::WriteImage(file, image); }

// Of another camera: the middle of the image alone.
void WriteMiddle(const fs::path& file, const ImageRgb8& image) {
  constexpr int kCutPx = 24;
  ImageRgb8 middle(image.width() - 2 * kCutPx, image.height(), 3);
  for (int y = 0; y < middle.height(); ++y) {
    for (int x = 0; x < middle.width(); ++x) {
      for (int c = 0; c < 3; ++c) middle(x, y, c) = image(x + kCutPx, y, c);
    }
  }
  io::WriteImage(file, middle);
}

struct Kind {
  const char* name;
  void (*write)(const fs::path&, const ImageRgb8&);
};
// Along the arc: those of the other camera are neighbours of those of the first.
constexpr Kind kKinds[kArcPhotos] = {
    {"\xc3\x84rger \xe5\x86\x99\xe7\x9c\x9f.png", WritePlain},
    {"- alpha.png", WriteAlpha},
    {"a b  c.tif", WriteTurned},
    {"other/1.png", WriteMiddle},
    {"linear.exr", WriteLinear},
    {"other/2.png", WriteMiddle},
    {"$HOME; rm -rf.jpg", WriteCmyk},
    {"progressive.jpeg", WriteProgressive},
    {"sixteen bits.PNG", WriteSixteenBits},
};

// Largest distance of a camera from its true place, after alignment, as a share of the median
// distance between neighbours. Measured: 0.0017; COLMAP does not repeat itself exactly.
constexpr double kMaxOff = 0.01;

TEST(AwkwardPhotosThroughColmap, AllHaveTheirCameras) {
  if (FindProgram("colmap").empty()) GTEST_SKIP() << "SKIPPED: colmap is absent";
  const TemporaryFolder folder;
  MakeArcPhotos(folder / "arc");
  const io::CameraList truth = io::ReadCamerasJson(folder / "arc/cameras.json");
  ASSERT_EQ(truth.cameras.size(), static_cast<size_t>(kArcPhotos));
  for (size_t i = 0; i < truth.cameras.size(); ++i) {
    const fs::path file = folder / "photos" / kKinds[i].name;
    fs::create_directories(file.parent_path());
    kKinds[i].write(file, io::ReadImage(folder / "arc/images" / truth.cameras[i].name));
  }
  const Ran ran = DtrOk({"build", (folder / "photos").string(), "-o", (folder / "set.dtr").string(),
                         "--engine", "none", "--threads", "2"});

  const DtrSet set = io::ReadSet(folder / "set.dtr");
  std::vector<Eigen::Vector3d> expected, found;
  for (size_t i = 0; i < truth.cameras.size(); ++i) {
    const auto& views = set.frames.at(0).views;
    const auto view = std::find_if(views.begin(), views.end(),
                                   [&](const View& v) { return v.name == kKinds[i].name; });
    ASSERT_NE(view, views.end()) << kKinds[i].name << " has no camera\n" << ran.err;
    expected.push_back(truth.cameras[i].cam_from_world.TargetOriginInSource());
    found.push_back(view->CenterInWorld());
  }
  std::vector<double> steps;
  for (size_t i = 1; i < expected.size(); ++i) {
    steps.push_back((expected[i] - expected[i - 1]).norm());
  }
  std::nth_element(steps.begin(), steps.begin() + steps.size() / 2, steps.end());
  const calib::Similarity aligned = calib::AlignPoints(found, expected);
  for (size_t i = 0; i < found.size(); ++i) {
    EXPECT_LT((aligned * found[i] - expected[i]).norm(), kMaxOff * steps[steps.size() / 2])
        << kKinds[i].name;
  }
}

// A model of known poses, as COLMAP's users make one by hand: images and points are empty.
TEST(PosesThroughColmap, OfAModelWithoutPointsArePointsTriangulated) {
  if (FindProgram("colmap").empty()) GTEST_SKIP() << "SKIPPED: colmap is absent";
  const TemporaryFolder folder;
  MakeArcPhotos(folder / "arc");
  const io::CameraList truth = io::ReadCamerasJson(folder / "arc/cameras.json");
  calib::SfmModel model;
  for (const io::NamedCamera& named : truth.cameras) {
    const auto id = static_cast<std::uint32_t>(model.images.size()) + 1;
    model.cameras[id] = colmap::FromPinhole(named.camera);
    model.images.push_back({id, named.name, id, named.cam_from_world, {}});
  }
  colmap::WriteModel(folder / "poses", model, colmap::Format::kText);
  const fs::path set = folder / "set.dtr";
  DtrOk({"build", (folder / "arc/images").string(), "-o", set.string(), "--poses",
         (folder / "poses").string(), "--engine", "none"});
  const DtrSet read = io::ReadSet(set);
  const auto& views = read.frames.front().views;
  ASSERT_EQ(views.size(), truth.cameras.size());
  EXPECT_GT(io::LoadSparse(set, read).points.size(), 100u);
  for (size_t i = 0; i < views.size(); ++i) {
    const Eigen::Vector3d centre =
        views[i].cam_from_world.TargetOriginInSource() + read.world_origin;
    EXPECT_LT((centre - truth.cameras[i].cam_from_world.TargetOriginInSource()).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace dtr::testing
