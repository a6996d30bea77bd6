// Videos of a rig: frames of one number are of one time step, also behind a damaged frame.
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "pipeline/boards/rig_photos.h"
#include "tests/capture/video/ffmpeg_videos.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using capture::testing::RunFfmpeg;

constexpr double kSameCornerPx = 1e-3;  // the same pixels are looked at

// The frames of the second camera, and where it sees the board's first corner.
std::map<std::string, Eigen::Vector2d> SecondCamera(const fs::path& folder) {
  SilentProgress silent;
  const RigPhotos photos =
      ReadRigPhotos(folder, calib::BoardFromText("chessboard:9x6:25mm"), {}, silent);
  EXPECT_EQ(photos.cameras.size(), 2u);
  std::map<std::string, Eigen::Vector2d> corners;
  for (const calib::RigView& view : photos.views) {
    if (view.camera == 1) {
      corners[photos.frames[view.frame]] = view.seen.corners.front().pixel;
    }
  }
  return corners;
}

TEST(RigVideos, FramesBehindADamagedOneStayWithThoseOfTheOtherCamera) {
  const fs::path photos = fs::absolute(dtr::testing::DataFolder()) / "chessboard_stereo_640x480";
  DTR_REQUIRE_DATA(photos);
  const dtr::testing::TemporaryFolder folder;
  for (const char* camera : {"left", "right"}) {
    fs::create_directories(folder / "whole");
    RunFfmpeg(folder.path(), {"-framerate", "10", "-start_number", "1", "-i",
                              (photos / camera).string() + "%02d.jpg", "-frames:v", "4", "-c:v",
                              "libx264", "-g", "1", std::string("whole/") + camera + ".mp4"});
  }
  fs::create_directories(folder / "rig");
  fs::copy_file(folder / "whole/left.mp4", folder / "rig/left.mp4");
  fs::copy_file(folder / "whole/left.mp4", folder / "rig/left.lrv");  // no third camera
  RunFfmpeg(folder.path(), {"-i", "whole/right.mp4", "-c", "copy", "-bsf:v",
                            "noise=amount=if(eq(n\\,1)\\,1\\,0)", "rig/right.mp4"});
  const auto whole = SecondCamera(folder / "whole"), damaged = SecondCamera(folder / "rig");
  ASSERT_EQ(whole.size(), 4u);
  ASSERT_EQ(damaged.size(), 3u);
  EXPECT_FALSE(damaged.contains("1"));
  for (const auto& [frame, corner] : damaged) {
    EXPECT_LT((corner - whole.at(frame)).norm(), kSameCornerPx) << frame;
  }
}

}  // namespace
}  // namespace dtr::pipeline
