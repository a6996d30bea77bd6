// Collections of several time steps: what moves, what stays, and that videos are the photos.
#include "datasets/make_dynamic.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "capture/video/frames.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/process.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/image_io.h"
#include "tests/support/test_data.h"

namespace dtr::datasets {
namespace {

namespace fs = std::filesystem;

DatasetSpec Toys() {
  DatasetSpec spec = DefaultSpecOf("toys");
  spec.views = 3;
  spec.steps = 3;
  spec.width_px = 96;
  spec.height_px = 64;
  spec.supersampling = 1;
  return spec;
}

void MakeSteps(const DatasetSpec& spec, const fs::path& folder) {
  SilentProgress progress;
  MakeDataset(spec, folder, progress);
}

TEST(MakeDynamicDataset, WritesPhotosRigAndTruthOfEveryTimeStep) {
  const testing::TemporaryFolder folder;
  MakeSteps(Toys(), folder / "toys");
  for (const std::string step : {"0000", "0001", "0002"}) {
    for (const std::string camera : {"cam00", "cam01", "cam02"}) {
      EXPECT_TRUE(fs::exists(folder / "toys/photos" / camera / (step + ".png")));
      const fs::path truth = folder / "toys/truth" / step;
      EXPECT_TRUE(fs::exists(truth / "depth" / (camera + ".exr")));
      EXPECT_TRUE(fs::exists(truth / "masks" / (camera + "_visible.png")));
      EXPECT_TRUE(fs::exists(truth / "masks" / (camera + "_texture.png")));
    }
  }
  const io::CameraList list = io::ReadCamerasJson(folder / "toys/truth/0001/cameras.json");
  ASSERT_EQ(list.cameras.size(), 3u);
  EXPECT_EQ(list.cameras[1].name, "cam01");
  EXPECT_EQ(list.cameras[0].cam_from_world.translation.norm(), 0);
  EXPECT_TRUE(fs::exists(folder / "toys/rig.json"));
}

TEST(MakeDynamicDataset, SomeDepthMovesAndMostStays) {
  const testing::TemporaryFolder folder;
  MakeSteps(Toys(), folder / "toys");
  const auto depth = [&](const std::string& step) {
    return io::ReadFloatGrid(folder / "toys/truth" / step / "depth/cam01.exr");
  };
  const Grid<float> first = depth("0000"), last = depth("0002");
  int moved = 0;
  for (size_t i = 0; i < first.data().size(); ++i) moved += first.data()[i] != last.data()[i];
  const double share = static_cast<double>(moved) / static_cast<double>(first.data().size());
  EXPECT_GT(share, 0.02);
  EXPECT_LT(share, 0.3);
}

TEST(MakeDynamicDataset, VideosReadBackToThePhotosBitForBit) {
  if (FindProgram("ffmpeg").empty()) GTEST_SKIP() << "SKIPPED: no program ffmpeg";
  const testing::TemporaryFolder folder;
  DatasetSpec spec = Toys();
  spec.noise = 2;
  MakeSteps(spec, folder / "photos");
  spec.videos = true;
  MakeSteps(spec, folder / "videos");
  int frames = 0;
  capture::ForEachFrame(
      folder / "videos/videos/cam02.mkv", [&](int number, const ImageRgb8& image) {
        const std::string name = "photos/cam02/000" + std::to_string(number) + ".png";
        EXPECT_EQ(image, io::ReadImage(folder / "photos" / name)) << number;
        ++frames;
        return true;
      });
  EXPECT_EQ(frames, spec.steps);
  EXPECT_EQ(ReadFile(folder / "videos/videos/timestamps.csv", 1000).substr(0, 40),
            "sync_index,cam_id,frame_index\n0,0,0\n0,1,");
}

TEST(MakeDynamicDataset, RejectsWhatDoesNotMoveOrGoWithTimeSteps) {
  const testing::TemporaryFolder folder;
  DatasetSpec still = Toys();
  still.scene = "plane";
  EXPECT_THROW(MakeSteps(still, folder / "plane"), UsageError);
  DatasetSpec lens = Toys();
  lens.k1 = 0.01;
  EXPECT_THROW(MakeSteps(lens, folder / "lens"), UsageError);
  DatasetSpec sphere = Toys();
  sphere.scene = "sphere";
  sphere.steps = 100;  // ten seconds: the ball is gone after one
  EXPECT_THROW(MakeSteps(sphere, folder / "sphere"), UsageError);
  EXPECT_TRUE(fs::is_empty(folder / "."));
}

TEST(MakeDynamicDataset, ItsSpecRoundTrips) {
  DatasetSpec spec = Toys();
  spec.videos = true;
  spec.steps_per_second = 15;
  const std::string text = FormatSpecJson(spec);
  EXPECT_EQ(FormatSpecJson(ParseSpecJson(text, "dataset.json")), text);
}

}  // namespace
}  // namespace dtr::datasets
