// Moving sets and files that come and go, in a real window.
#include "tests/viewer/moving_window.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

using MovingWindowTest = MovingWindow;

TEST_F(MovingWindowTest, BeginsAtAnyTimeStepAndShowsWhatRenderShows) {
  Open(96, 64, {"--no-panel", "--frame", "1", "--like", "0002"});
  if (IsSkipped()) return;
  const Json start = Now();
  EXPECT_EQ(start["time_step"], 1);
  EXPECT_EQ(start["time_steps"], 3);
  Do({"mousemove", "40", "30", "key", "p"});
  Wait("an image", [&](const Json&) { return fs::exists(In("moving-image-001.png")); });
  DtrOk({"render", Set(), "--frame", "1", "--like", "0002", "-o", In("rendered.png")});
  EXPECT_EQ(Differing(io::ReadImage(In("moving-image-001.png")), io::ReadImage(In("rendered.png"))),
            0);
}

TEST_F(MovingWindowTest, WhatIsLeftOutOfOneTimeStepIsLeftOutOfAll) {
  Open(96, 64, {"--no-panel", "--like", "0000"});
  if (IsSkipped()) return;
  Do({"mousemove", "40", "30", "key", "h"});
  Wait("a view left out", [](const Json& s) { return s["hidden"] == Json::array({"0000.jpg"}); });
  Press("n");
  const Json next = Wait("the next time step", [](const Json& s) { return s["time_step"] == 1; });
  EXPECT_EQ(next["hidden"], Json::array({"0000.jpg"}));
  for (const Json& name : next["views_used"]) EXPECT_NE(name, "0000.jpg");
}

TEST_F(MovingWindowTest, PlaysFromTheStartAndEndsWithAWholePicture) {
  Open(96, 64);  // a display
  if (IsSkipped()) return;
  const Json json = Json::parse(DtrOk({"view", Set(), "--play", "--frames", "100", "--size",
                                       "96x64", "-o", folder_.path().string(), "--json", "-"})
                                    .out);
  // Between time steps a frame waits 20 ms: there were at least three of half a second.
  EXPECT_GE(json["moving"]["frames"], 3);
  EXPECT_TRUE(json["last"]["still"].get<bool>());
  EXPECT_FALSE(json["last"]["playing_time"].get<bool>());
  ExpectRejected(Dtr({"view", Set(), "--frame", "3"}), kWrongUsage, "--frame");
}

TEST_F(MovingWindowTest, AFileThatVanishedAndCameBackIsDrawnFromAgain) {
  // The pixels of what is drawn stay in memory where something looks at them; the magnifier does.
  const fs::path set = In("mine.dtr");
  fs::copy(Set(), set, fs::copy_options::recursive);
  const DtrSet described = io::ReadSet(set);
  const View& first = described.frames[0].views[0];
  const fs::path photo = set / first.image_file->path;
  Open(200, 140, {"--no-panel"}, set);
  if (IsSkipped()) return;
  const Json whole = Now();
  ASSERT_EQ(whole["views_used"].size(), 4U);
  fs::rename(photo, In("away.jpg"));
  Do({"mousemove", "100", "70", "key", "g"});
  Wait("word of lost pixels", [](const Json& s) {
    return s["message"].get<std::string>().find("be read") != std::string::npos;
  });
  Do({"key", "w"});
  const Json without =
      Wait("an image without it", [](const Json& s) { return s["views_used"].size() == 3; });
  for (const Json& name : without["views_used"]) EXPECT_NE(name, first.name);
  fs::rename(In("away.jpg"), photo);
  const Json again =
      Wait("an image with it", [](const Json& s) { return s["views_used"].size() == 4; });
  EXPECT_EQ(again["reloads"], 0) << "the set itself never changed";
  Press("g");
  Wait("figures under the cursor", [](const Json& s) { return s["under_cursor"].size() == 4; });
}

}  // namespace
}  // namespace dtr::testing
