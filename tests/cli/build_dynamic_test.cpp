// `dtr build --dynamic` as its users meet it: the toys as fixed cameras saw them.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "dtr/base/process.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Json = nlohmann::json;

constexpr int kSteps = 4;

/// Photos of five cameras and a set of them, made once. For reading only.
class BuildDynamic : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = new TemporaryFolder;
    DtrOk({"dataset", "make", "toys", "-o", At("toys"), "--views", "5", "--steps",
           std::to_string(kSteps), "--width", "160", "--height", "108", "--noise", "1",
           "--supersampling", "1"});
    DtrOk(Build("set.dtr"));
  }
  static void TearDownTestSuite() {
    delete shared_;
    shared_ = nullptr;
  }
  static std::string At(const std::string& name) { return (*shared_ / name).string(); }
  static std::vector<std::string> Build(const std::string& set,
                                        const std::vector<std::string>& more = {},
                                        const std::string& photos = "toys/photos",
                                        const std::string& holdout = "cam02") {
    std::vector<std::string> words{
        "build", At(photos), "--dynamic", "--rig",          At("toys/rig.json"),
        "-o",    At(set),    "--holdout", holdout,          "--preset",
        "fast",  "--passes", "1",         "--no-completion"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  inline static TemporaryFolder* shared_ = nullptr;
};

TEST_F(BuildDynamic, HasAFrameForEachTimeStepAndItsCamerasStandStill) {
  const DtrSet set = io::LoadSet(At("set.dtr"), {.held_out = true});
  ASSERT_EQ(set.frames.size(), static_cast<size_t>(kSteps));
  for (size_t step = 0; step < set.frames.size(); ++step) {
    ASSERT_EQ(set.frames[step].views.size(), 5u);
    for (size_t c = 0; c < 5; ++c) {
      const View &view = set.frames[step].views[c], &first = set.frames[0].views[c];
      EXPECT_EQ(view.name, "cam0" + std::to_string(c));
      EXPECT_EQ(view.id, "t000" + std::to_string(step) + "_cam0" + std::to_string(c));
      EXPECT_EQ(view.cam_from_world.translation, first.cam_from_world.translation);
      EXPECT_EQ(view.reference_baseline, first.reference_baseline);
      EXPECT_EQ(view.role, c == 2 ? ViewRole::kHeldOut : ViewRole::kSource);
      EXPECT_EQ(view.depth.empty(), c == 2);
    }
  }
  EXPECT_EQ(set.unit, LengthUnit::kMetre);
  // At ten time steps per second, which photos do not say: 24.
  EXPECT_DOUBLE_EQ(set.frames[1].time_s, 1.0 / 24);
  EXPECT_EQ(DtrOk({"info", At("set.dtr"), "--verify"}).code, 0);
}

TEST_F(BuildDynamic, WhatStandsStillKeepsOneDepth) {
  const DtrSet set = io::LoadSet(At("set.dtr"));
  long same = 0, all = 0;
  for (size_t c = 0; c < set.frames[0].views.size(); ++c) {
    const DepthImage& first = set.frames[0].views[c].depth;
    const DepthImage& last = set.frames[kSteps - 1].views[c].depth;
    for (size_t i = 0; i < first.grid().data().size(); ++i) {
      if (DepthImage::IsHole(first.grid().data()[i])) continue;
      ++all;
      same += first.grid().data()[i] == last.grid().data()[i];
    }
  }
  // The toys with their shadows and what matching them reaches: less than a third of the images.
  EXPECT_GT(static_cast<double>(same) / static_cast<double>(all), 0.67);
  EXPECT_LT(same, all);
}

TEST_F(BuildDynamic, IsMeasuredAgainstTruthAndHeldOutCamerasOverTime) {
  const Json json = Json::parse(DtrOk({"evaluate", At("set.dtr"), "--renderer", "cpu", "--depth",
                                       At("toys/truth"), "--json", "-"})
                                    .out);
  EXPECT_EQ(json["time_steps"], kSteps);
  ASSERT_EQ(json["views"].size(), 1u);
  EXPECT_EQ(json["views"][0]["name"], "cam02");
  EXPECT_GT(json["views"][0]["psnr_db"], 18);
  EXPECT_GT(json["depth"]["share_within_2pct"], 0.5);
  EXPECT_GT(json["flicker"]["pixels"], 1000);
  EXPECT_LT(json["flicker"]["median_relative_deviation"], 1e-6);
}

TEST_F(BuildDynamic, VideosGiveTheSameSetAsPhotos) {
  if (FindProgram("ffmpeg").empty()) GTEST_SKIP() << "SKIPPED: no program ffmpeg";
  DtrOk({"dataset", "make", "toys", "-o", At("filmed"), "--views", "5", "--steps",
         std::to_string(kSteps), "--width", "160", "--height", "108", "--noise", "1",
         "--supersampling", "1", "--videos"});
  DtrOk(Build("filmed.dtr", {"--fps", "24"}, "filmed/videos"));
  const DtrSet photos = io::LoadSet(At("set.dtr")), videos = io::LoadSet(At("filmed.dtr"));
  ASSERT_EQ(videos.frames.size(), photos.frames.size());
  for (size_t step = 0; step < photos.frames.size(); ++step) {
    for (size_t c = 0; c < photos.frames[step].views.size(); ++c) {
      EXPECT_EQ(videos.frames[step].views[c].image, photos.frames[step].views[c].image);
      EXPECT_EQ(videos.frames[step].views[c].depth.grid(),
                photos.frames[step].views[c].depth.grid());
    }
  }
}

void MakeToys(const std::string& folder, const std::vector<std::string>& more) {
  std::vector<std::string> words{
      "dataset", "make",     "toys", "-o",      folder, "--views",         "5", "--width",
      "120",     "--height", "80",   "--noise", "1",    "--supersampling", "1"};
  words.insert(words.end(), more.begin(), more.end());
  DtrOk(words);
}

TEST_F(BuildDynamic, OfFasterVideosTheFramesNearestInTimeAreTaken) {
  if (FindProgram("ffmpeg").empty()) GTEST_SKIP() << "SKIPPED: no program ffmpeg";
  MakeToys(At("slow"), {"--steps", "5", "--fps", "10", "--videos"});
  MakeToys(At("fast"), {"--steps", "12", "--fps", "25", "--videos"});
  MakeToys(At("stills"), {"--steps", "12", "--fps", "25"});
  fs::copy_file(At("fast/videos/cam00.mkv"), At("slow/videos/cam00.mkv"),
                fs::copy_options::overwrite_existing);
  fs::remove(At("slow/videos/timestamps.csv"));  // which states the frames of each time step
  const Ran ran = DtrOk({"build", At("slow/videos"), "--dynamic", "--rig", At("slow/rig.json"),
                         "--engine", "none", "-o", At("rates.dtr")});
  EXPECT_THAT(ran.err, HasSubstr("cam01.mkv: 10.000 frames per second, cam00.mkv: 25.000"));
  const DtrSet set = io::LoadSet(At("rates.dtr"));
  ASSERT_EQ(set.frames.size(), 5u);
  const int nearest[] = {0, 3, 5, 8, 10};  // of 25 frames a second; half a frame goes up
  for (size_t step = 0; step < 5; ++step) {
    EXPECT_DOUBLE_EQ(set.frames[step].time_s, 0.1 * static_cast<double>(step));
    EXPECT_EQ(set.frames[step].views[0].image,
              io::ReadImage(At(fmt::format("stills/photos/cam00/{:04}.png", nearest[step]))));
  }
}

// Photos of 24 time steps; in `apart` two cameras began at other times than the rest.
void MakePhotosWithClocksApart(const std::string& toys, const std::string& apart) {
  MakeToys(toys, {"--steps", "24"});
  for (int camera = 0; camera < 5; ++camera) {
    const std::string folder = fmt::format("/cam0{}/", camera);
    const int later = camera == 1 ? 3 : camera == 3 ? -2 : 0;
    fs::create_directories(apart + folder);
    for (int step = 0; step < 24; ++step) {
      fs::copy_file(toys + "/photos" + folder + fmt::format("{:04}.png", step),
                    apart + folder + fmt::format("{:04}.png", step + later + 5));
    }
  }
}

TEST_F(BuildDynamic, ClocksThatDifferAreFoundFromWhatMoves) {
  MakePhotosWithClocksApart(At("clocks"), At("clocks-apart"));
  const Ran ran =
      DtrOk({"build", At("clocks-apart"), "--dynamic", "--clocks", "free", "--to", "23", "--rig",
             At("clocks/rig.json"), "--engine", "none", "-o", At("apart.dtr")});
  EXPECT_THAT(ran.err, HasSubstr("clocks: frames later than those of cam00"));
  const DtrSet set = io::LoadSet(At("apart.dtr"));
  ASSERT_EQ(set.frames.size(), 24u);
  for (size_t step = 0; step < set.frames.size(); ++step) {
    for (const View& view : set.frames[step].views) {
      EXPECT_EQ(view.image,
                io::ReadImage(At(fmt::format("clocks/photos/{}/{:04}.png", view.name, step))))
          << view.name << " at " << step;
    }
  }
  const Json clocks = Json::parse(set.provenance_json)["dynamic"]["found_clocks"];
  const int later[] = {0, 3, 0, -2, 0};
  for (size_t c = 0; c < 5; ++c) {
    EXPECT_EQ(clocks[c]["frames_taken_later"], later[c]);
    // The nearest frame is taken: half a frame off would be the wrong one.
    EXPECT_NEAR(clocks[c]["frames_later"], later[c], 0.3);
  }
}

TEST_F(BuildDynamic, ClocksOfAStillSceneAreRejected) {
  fs::create_directories(At("still"));
  for (const std::string camera : {"cam00", "cam01"}) {
    fs::create_directories(At("still/" + camera));
    for (int step = 0; step < 12; ++step) {
      fs::copy_file(At("toys/photos/" + camera + "/0000.png"),
                    At("still/" + camera + fmt::format("/{:04}.png", step)));
    }
  }
  ExpectRejected(Dtr({"build", At("still"), "--dynamic", "--clocks", "free", "--rig",
                      At("toys/rig.json"), "-o", At("still.dtr")}),
                 kFailed, "clocks: camera cam01: expected motion that it and another camera see");
}

TEST_F(BuildDynamic, GoesOnWhereItWasInterruptedToTheSameBytes) {
  fs::create_directories(At("again"));  // the set's page has its name: it must be the same
  const fs::path partial = At("again/set.dtr") + ".partial";
  const Ran stopped =
      Dtr(Build("again/set.dtr"), {SIGTERM, [&] {
                                     return fs::exists(partial / "depth/t0001_cam01.png") ||
                                            fs::exists(partial / "depth/t0001_cam01.exr");
                                   }});
  EXPECT_NE(stopped.code, 0);
  EXPECT_FALSE(fs::exists(At("again/set.dtr")));
  DtrOk(Build("again/set.dtr"));
  EXPECT_EQ(DifferingFiles(Contents(At("set.dtr")), Contents(At("again/set.dtr"))),
            std::vector<std::string>());
}

TEST_F(BuildDynamic, WhatStandsStillIsStoredOnce) {
  const DtrSet set = io::ReadSet(At("set.dtr"));
  for (const Frame& frame : set.frames) {
    for (size_t c = 0; c < frame.views.size(); ++c) {
      const View &view = frame.views[c], &first = set.frames[0].views[c];
      if (view.role == ViewRole::kHeldOut) continue;
      ASSERT_TRUE(view.depth_base && view.sigma_base) << view.id;
      EXPECT_EQ(view.depth_base, first.depth_base);
      EXPECT_EQ(view.sigma_base, first.sigma_base);
    }
  }
  const Json info = Json::parse(DtrOk({"info", At("set.dtr"), "--json", "-"}).out);
  EXPECT_GT(info["parts"]["still_parts"], 0);
  EXPECT_LT(info["parts"]["depth"], kSteps * info["parts"]["still_parts"].get<double>() / 2);
}

TEST_F(BuildDynamic, CompletedDepthOfWhatStandsStillIsTheSameAtAllTimeSteps) {
  std::vector<std::string> words = Build("completed.dtr");
  std::erase(words, "--no-completion");
  DtrOk(words);
  const DtrSet set = io::LoadSet(At("completed.dtr"), {.completed = true});
  long same = 0, all = 0;
  for (size_t c = 0; c < set.frames[0].views.size(); ++c) {
    const View &first = set.frames[0].views[c], &last = set.frames[kSteps - 1].views[c];
    ASSERT_TRUE(first.completed_file && last.completed_file);
    EXPECT_EQ(first.completed_steps, last.completed_steps);
    EXPECT_EQ(first.completed_near_z, last.completed_near_z);
    for (size_t i = 0; i < first.depth.grid().data().size(); ++i) {
      EXPECT_FALSE(DepthImage::IsHole(last.depth.grid().data()[i]));
      if (first.depth_state.data()[i] == DepthState::kMeasured) continue;
      ++all;
      same += first.depth.grid().data()[i] == last.depth.grid().data()[i];
    }
  }
  ASSERT_GT(all, 1000);
  // As of measured depth, above.
  EXPECT_GT(static_cast<double>(same) / static_cast<double>(all), 0.67);
}

TEST_F(BuildDynamic, LosslessVideosAreTheImagesThemselves) {
  if (FindProgram("ffmpeg").empty()) GTEST_SKIP() << "SKIPPED: no program ffmpeg";
  fs::create_directories(At("video"));
  const auto words = Build("video/set.dtr", {"--video", "lossless"});
  const fs::path partial = At("video/set.dtr") + ".partial";
  const Ran stopped =
      Dtr(words, {SIGTERM, [&] { return fs::exists(partial / "video/t0000_cam01.mp4"); }});
  EXPECT_NE(stopped.code, 0);
  DtrOk(words);
  const DtrSet images = io::LoadSet(At("set.dtr")), videos = io::LoadSet(At("video/set.dtr"));
  for (size_t step = 0; step < images.frames.size(); ++step) {
    for (size_t c = 0; c < images.frames[step].views.size(); ++c) {
      const View &a = images.frames[step].views[c], &b = videos.frames[step].views[c];
      EXPECT_EQ(a.image, b.image) << a.id;
      EXPECT_EQ(a.depth.grid(), b.depth.grid()) << a.id;
      EXPECT_EQ(b.image_frame, static_cast<int>(step));
    }
  }
  fs::create_directories(At("whole"));
  DtrOk(Build("whole/set.dtr", {"--video", "lossless", "--threads", "1"}));
  EXPECT_EQ(DifferingFiles(Contents(At("video/set.dtr")), Contents(At("whole/set.dtr"))),
            std::vector<std::string>());
  const auto psnr_of = [&](const std::string& set) {
    return Json::parse(
        DtrOk({"evaluate", At(set), "--renderer", "cpu", "--json", "-"}).out)["mean"]["psnr_db"];
  };
  EXPECT_EQ(psnr_of("video/set.dtr"), psnr_of("set.dtr"));
}

TEST_F(BuildDynamic, DoesNotDependOnThreads) {
  fs::create_directories(At("one"));
  DtrOk(Build("one/set.dtr", {"--threads", "1"}));
  EXPECT_EQ(DifferingFiles(Contents(At("set.dtr")), Contents(At("one/set.dtr"))),
            std::vector<std::string>());
}

TEST_F(BuildDynamic, TakesTheTimeStepsThatAreChosen) {
  DtrOk(Build("some.dtr", {"--from", "1", "--to", "3", "--every", "2", "--engine", "none"}));
  const DtrSet set = io::ReadSet(At("some.dtr"));
  ASSERT_EQ(set.frames.size(), 2u);
  EXPECT_EQ(set.frames[0].time_s, 0);
  EXPECT_DOUBLE_EQ(set.frames[1].time_s, 2.0 / 24);
}

TEST_F(BuildDynamic, PartsOfARecordingAreJoinedWithStillDepthOnce) {
  const auto build = [](const std::string& set, const std::vector<std::string>& steps) {
    std::vector<std::string> words = Build(set, steps);
    std::erase(words, "--no-completion");
    DtrOk(words);
  };
  build("early.dtr", {"--to", "2", "--fps", "10"});
  build("late.dtr", {"--from", "1", "--fps", "10"});
  DtrOk({"join", At("early.dtr"), At("late.dtr"), "-o", At("parts.dtr"), "--video", "lossless"});
  const Json info = Json::parse(DtrOk({"info", At("parts.dtr"), "--verify", "--json", "-"}).out);
  EXPECT_EQ(info["frames"], 6);
  io::LoadOptions all;
  all.sigma = all.held_out = all.completed = true;
  const DtrSet joined = io::LoadSet(At("parts.dtr"), all);
  ASSERT_EQ(joined.frames.size(), 6u);
  for (size_t step = 0; step < joined.frames.size(); ++step) {
    const DtrSet part = io::LoadSet(At(step < 3 ? "early.dtr" : "late.dtr"), all);
    EXPECT_NEAR(joined.frames[step].time_s, 0.1 * static_cast<double>(step), 1e-12);
    for (size_t c = 0; c < 5; ++c) {
      const View &view = joined.frames[step].views[c], &own = part.frames[step % 3].views[c];
      EXPECT_EQ(view.id, fmt::format("t000{}_cam0{}", step, c));
      EXPECT_EQ(view.image, own.image);
      EXPECT_EQ(view.depth.grid(), own.depth.grid());
      EXPECT_EQ(view.depth_base.has_value(), c != 2);  // the held-out one has no depth
      EXPECT_EQ(view.depth_state.data(), own.depth_state.data());
      EXPECT_EQ(view.mesh_file.has_value(), c != 2);
    }
  }
}

TEST_F(BuildDynamic, TruthOfEveryTimeStepIsNeeded) {
  ExpectRejected(Dtr({"evaluate", At("set.dtr"), "--renderer", "cpu", "--depth", At("nothing")}),
                 kWrongUsage,
                 "expected a folder with one folder of truth for each time step, found nothing");
  fs::create_directories(At("half/0000"));
  ExpectRejected(Dtr({"evaluate", At("set.dtr"), "--renderer", "cpu", "--depth", At("half")}),
                 kWrongUsage, "expected a folder of truth for time step");
}

TEST_F(BuildDynamic, NoTimeStepOfAllCamerasIsAnError) {
  const auto copy = [&](const std::string& from, const std::string& to) {
    fs::create_directories(fs::path(At(to)).parent_path());
    fs::copy_file(At("toys/photos/" + from), At(to));
  };
  copy("cam00/0000.png", "apart/cam00/0000.png");
  copy("cam01/0001.png", "apart/cam01/0001.png");
  ExpectRejected(Dtr(Build("none.dtr", {}, "apart", "")), kFailed,
                 "expected time steps with an image of each of the");
}

TEST_F(BuildDynamic, CamerasOfAnotherSizeAreNamed) {
  DtrOk({"dataset", "make", "toys", "-o", At("small"), "--views", "3", "--steps", "3", "--width",
         "80", "--height", "54", "--supersampling", "1"});
  ExpectRejected(Dtr(Build("none.dtr", {}, "small/photos", "")), kFailed,
                 "camera cam00: expected 160 x 108 px as it was calibrated with, found 80 x 54");
  // The first time step fits, a later one does not.
  for (const std::string camera : {"cam00", "cam01", "cam02", "cam03", "cam04"}) {
    for (const std::string step : {"0000.png", "0001.png", "0002.png"}) {
      fs::create_directories(At("mixed/" + camera));
      fs::copy_file(At("toys/photos/" + camera + "/" + step), At("mixed/" + camera + "/" + step));
    }
  }
  fs::copy_file(At("small/photos/cam00/0002.png"), At("mixed/cam00/0002.png"),
                fs::copy_options::overwrite_existing);
  ExpectRejected(Dtr(Build("mixed.dtr", {}, "mixed")), kFailed,
                 "camera cam00, time step 0002: expected 160 x 108 px as its other images, found "
                 "80 x 54");
  ExpectRejected(Dtr(Build("mixed-free.dtr", {"--clocks", "free"}, "mixed")), kFailed,
                 "camera cam00: expected 160 x 108 px as it was calibrated with, found 80 x 54");
}

TEST_F(BuildDynamic, RejectsWhatDoesNotGoTogether) {
  const auto rejected = [&](const std::vector<std::string>& more, int code,
                            const std::string& text) {
    ExpectRejected(Dtr(Build("none.dtr", more)), code, text);
    EXPECT_FALSE(fs::exists(At("none.dtr.partial")));
  };
  rejected({"--video", "52"}, kWrongUsage, "--video: expected a rate factor of 1 to 51");
  rejected({"--to", "9"}, kWrongUsage, "expected 0 <= from <= to <=");
  rejected({"--engine", "sgbm"}, kWrongUsage, "needs --engine patchmatch");
  rejected({"--poses", At("toys/rig.json")}, kWrongUsage,
           "holds the cameras of --rig, or finds them");
  ExpectRejected(Dtr({"build", At("toys/photos/cam00"), "--dynamic", "-o", At("none.dtr")}),
                 kWrongUsage, "expected at least 2 cameras");
  fs::create_directories(At("other"));
  fs::create_directory_symlink(At("toys/photos/cam00"), At("other/cam00"));
  fs::create_directory_symlink(At("toys/photos/cam01"), At("other/left"));
  ExpectRejected(Dtr(Build("none.dtr", {}, "other", "")), kFailed,
                 "camera left: expected one of its cameras");
  EXPECT_FALSE(fs::exists(At("none.dtr")));
}

}  // namespace
}  // namespace dtr::testing
