// A set of two time steps: made, joined, told of, drawn through time, and rejected where only still
// scenes are known.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "dtr/render/time_steps.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/moving_sphere_set.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class DynamicSet : public MovingSphereSet {};

/// By each renderer: both must know which time step an image shows.
class DynamicSetBy : public MovingSphereSet, public ::testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    const Ran ran = Dtr({"render", Set(), "--renderer", GetParam(), "--like", "0001.jpg", "--frame",
                         "0", "-o", In("probe.png")});
    if (ran.code != 0 && ran.err.find("use --renderer cpu") != std::string::npos) {
      GTEST_SKIP() << ran.err;
    }
  }
};
INSTANTIATE_TEST_SUITE_P(Renderers, DynamicSetBy, ::testing::Values("cpu", "gl", "simd"));

double MeanDifference(const fs::path& a_file, const fs::path& b_file) {
  const ImageRgb8 a = io::ReadImage(a_file), b = io::ReadImage(b_file);
  EXPECT_EQ(a.data().size(), b.data().size());
  double sum = 0;
  for (size_t i = 0; i < a.data().size(); ++i) sum += std::abs(a.data()[i] - b.data()[i]);
  return sum / static_cast<double>(a.data().size());
}

TEST_F(DynamicSet, HasBothTimeStepsAndEveryFileItsHash) {
  const Json info = Json::parse(DtrOk({"info", Set(), "--verify", "--json", "-"}).out);
  EXPECT_EQ(info["frames"], 2);
  EXPECT_EQ(info["views"].size(), 8u);
  const DtrSet set = io::LoadSet(Set());
  ASSERT_EQ(set.frames.size(), 2u);
  EXPECT_EQ(set.frames[0].time_s, 0);
  EXPECT_EQ(set.frames[1].time_s, 0.5);
  for (size_t i = 0; i < 4; ++i) {
    const View &before = set.frames[0].views[i], &after = set.frames[1].views[i];
    EXPECT_EQ(before.name, after.name);
    EXPECT_EQ(before.cam_from_world.translation, after.cam_from_world.translation);
    EXPECT_NE(before.depth.grid(), after.depth.grid());
  }
}

TEST_F(DynamicSet, PixelsAreThoseOfTheSetsThatWereJoined) {
  const DtrSet moving = io::LoadSet(Set());
  for (const auto& [name, frame] : {std::pair{"t0.dtr", 0u}, std::pair{"t0.5.dtr", 1u}}) {
    const DtrSet still = io::LoadSet(At(name));
    for (size_t i = 0; i < 4; ++i) {
      const View &joined = moving.frames[frame].views[i], &alone = still.frames[0].views[i];
      EXPECT_EQ(joined.image, alone.image);
      EXPECT_EQ(joined.depth.grid(), alone.depth.grid());
    }
  }
}

TEST_P(DynamicSetBy, EachFrameShowsItsOwnTimeStep) {
  const std::string name[] = {"t0", "t0.5"};
  for (const size_t frame : {0u, 1u}) {
    const std::string picture = In("frame" + std::to_string(frame) + ".png");
    DtrOk({"render", Set(), "--renderer", GetParam(), "--like", "0001.jpg", "--frame",
           std::to_string(frame), "-o", picture});
    // JPEG and blending of four views: below 3 levels; the ball elsewhere: above 6.
    EXPECT_LT(MeanDifference(picture, At(name[frame] + "/images/0001.jpg")), 3);
    EXPECT_GT(MeanDifference(picture, At(name[1 - frame] + "/images/0001.jpg")), 6);
  }
}

TEST_P(DynamicSetBy, PlaysFromOnePlaceAndAlongAPath) {
  const Json played = Json::parse(DtrOk({"render", Set(), "--renderer", GetParam(), "--like",
                                         "0001.jpg", "--play", "-o", In("played"), "--json", "-"})
                                      .out);
  ASSERT_EQ(played["frames"].size(), 2u);
  EXPECT_EQ(played["frames"][0]["frame"], 0);
  EXPECT_EQ(played["frames"][1]["frame"], 1);
  EXPECT_GT(MeanDifference(In("played/000000.png"), In("played/000001.png")), 3);

  const Json flown = Json::parse(DtrOk({"render", Set(), "--renderer", GetParam(), "--fly-through",
                                        "6", "-o", In("flown.mp4"), "--json", "-"})
                                     .out);
  std::vector<int> shown;
  for (const Json& frame : flown["frames"]) shown.push_back(frame["frame"]);
  EXPECT_EQ(shown, (std::vector<int>{0, 0, 0, 1, 1, 1}));
  EXPECT_GT(fs::file_size(In("flown.mp4")), 1000u);
}

// Images from sets of one time step each and from the dynamic set are the same, to the byte: no
// view of another time step has a say, nor what a renderer kept of one.
TEST_P(DynamicSetBy, ATimeStepOfADynamicSetIsDrawnAsASetOfItsOwn) {
  DtrOk(
      {"render", Set(), "--renderer", GetParam(), "--like", "0002.jpg", "--play", "-o", In("all")});
  const std::string sets[] = {At("t0.dtr"), At("t0.5.dtr")};
  for (size_t i = 0; i < 2; ++i) {
    DtrOk({"render", sets[i], "--renderer", GetParam(), "--like", "0002.jpg", "-o", In("one.png"),
           "--force"});
    EXPECT_EQ(io::ReadImage(In("one.png")).data(),
              io::ReadImage(In("all") + "/00000" + std::to_string(i) + ".png").data())
        << i;
  }
}

TEST_F(DynamicSet, WhatKnowsStillScenesAloneSaysSo) {
  const std::string words = "expected one frame, found 2";
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"evaluate", Set(), "--renderer", "cpu", "--leave-one-out"},
           {"validate", Set()},
           {"stereo", Set()},
           {"inspect", Set(), "-o", At("page.html")},
           {"prune", Set(), "-o", At("small.dtr"), "--renderer", "cpu"},
           {"advise", Set()},
           {"bench", Set(), "--renderer", "cpu"}}) {
    SCOPED_TRACE(command.front());
    ExpectRejected(Dtr(command), 2, words);
  }
  ExpectRejected(Dtr({"render", Set(), "--renderer", "cpu", "--like", "0001.jpg", "--frame", "2",
                      "-o", At("none.png")}),
                 2, "expected 0 to 1, the set has 2 frames");
  ExpectRejected(Dtr({"render", Set(), "--renderer", "cpu", "--fly-through", "4", "--play", "-o",
                      At("none.mp4")}),
                 2, "--play: expected --like or --camera with it");
  ExpectRejected(Dtr({"export", Set(), "-o", At("colmap")}), 1,
                 "export to COLMAP: expected a set with one frame, found 2");
  ExpectRejected(Dtr({"dataset", "make", "plane", "-o", At("p"), "--time", "1"}), 2,
                 "where nothing moves");
}

TEST_F(DynamicSet, ItsWebPageHasTheViewsOfAllTimeSteps) {
  DtrOk({"export", Set(), "--format", "web", "-o", In("site/")});
  const Json set = Json::parse(Text(In("site/set.json")));
  EXPECT_EQ(set["time_steps"],
            (Json{{{"time_s", 0}, {"views", 4}}, {{"time_s", 0.5}, {"views", 4}}}));
  EXPECT_EQ(set["views"].size(), 8u);
}

// What up is, and whose metres, are told by the scale's provenance.
TEST_F(DynamicSet, HowLengthsWereFoundIsKeptWhereAllTimeStepsSayTheSame) {
  const auto joined_scale = [&](const std::vector<Json>& scales) {
    std::vector<std::string> join = {"join"};
    for (size_t i = 0; i < scales.size(); ++i) {
      const std::string copy = In("copy" + std::to_string(i) + ".dtr");
      fs::remove_all(copy);
      fs::copy(At("t0.dtr"), copy, fs::copy_options::recursive);
      Json set = Json::parse(Text(copy + "/set.json"));
      if (!scales[i].is_null()) set["provenance"]["scale"] = scales[i];
      WriteFileAtomically(copy + "/set.json", set.dump());
      join.push_back(copy);
    }
    join.insert(join.end(), {"-o", In("joined.dtr"), "--fps", "2", "--force"});
    DtrOk(join);
    return Json::parse(io::ReadSet(In("joined.dtr")).provenance_json).value("scale", Json());
  };
  const Json gps = {{{"method", "gps"}, {"axes", "east, north, up"}}};
  const Json board = {{{"method", "board"}}};
  EXPECT_EQ(joined_scale({gps, gps}), gps);
  EXPECT_EQ(joined_scale({gps, board}), Json());
  EXPECT_EQ(joined_scale({gps, Json()}), Json());
  EXPECT_EQ(joined_scale({Json(), gps}), Json());
}

TEST(TimeStepOfImage, GivesEveryFrameItsShare) {
  EXPECT_EQ(TimeStepOfImage(0, 1, 5), 0u);
  EXPECT_EQ(TimeStepOfImage(9, 10, 2), 1u);
  EXPECT_EQ(TimeStepOfImage(4, 10, 2), 0u);
  EXPECT_EQ(TimeStepOfImage(2, 3, 7), 4u);
}

}  // namespace
}  // namespace dtr::testing
