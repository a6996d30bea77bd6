// tests/cli/resuming_video.h -- builds of a video by structure from motion, to be stopped. COLMAP
// is a stand-in that leaves the true model with noise, so that what follows it repeats to the byte:
// frames, refinement, undistortion and validation are under what stops them.
#pragma once
#include "calib/colmap/model_io.h"
#include "dtr/base/process.h"
#include "tests/cli/fake_sfm.h"
#include "tests/cli/resuming.h"

namespace dtr::testing {

inline constexpr double kSfmNoisePx = 0.2;  // of the features, for refinement to have work

class VideoBySfm : public FullDisk {
 protected:
  void MakeInputs() override {
    if (FindProgram("ffmpeg").empty()) GTEST_SKIP() << "SKIPPED: ffmpeg is absent";
    const std::filesystem::path courtyard = folder_ / "courtyard";
    MakeSmallCourtyard(courtyard);
    const ProcessResult made =
        RunProcess({"ffmpeg", "-loglevel", "error", "-framerate", "10", "-i",
                    (courtyard / "images/%04d.jpg").string(), "-c", "copy", Video()},
                   {});
    ASSERT_TRUE(made.Ok());
    calib::SfmModel model = colmap::ReadModel(courtyard / "sparse");
    for (auto& [id, camera] : model.cameras) {
      const PinholeCamera c = camera.Pinhole();
      camera.model = calib::CameraModel::kSimpleRadial;
      camera.params = {c.fx_px(), c.cx_px(), c.cy_px(), -0.01};
    }
    Random random(3);
    for (calib::SfmImage& image : model.images) {
      for (auto& feature : image.features) {
        const double x = random.Normal();
        feature.pixel += kSfmNoisePx * Eigen::Vector2d(x, random.Normal());
      }
    }
    LeaveModel(colmap_, model);
  }
  std::vector<std::string> Inputs() const override {
    return {Video(), "--every", "1", "--sfm", "colmap"};
  }
  std::string Video() const { return (folder_ / "walk.avi").string(); }

  colmap::testing::FakeColmap colmap_;
};

}  // namespace dtr::testing
