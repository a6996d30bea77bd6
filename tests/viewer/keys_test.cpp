// Every line of the viewer's help, in a real window: what is done, and what must have changed.
#include <set>

#include "tests/viewer/moving_window.h"
#include "viewer/glfw/keys.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class Keys : public MovingWindow {
 protected:
  struct Row {
    std::string keys;  ///< as the help has them
    std::function<void()> test;
  };
  std::vector<Row> Rows();

 private:
  static std::vector<std::string> Drag(int button) {
    const std::string b = std::to_string(button);
    return {"mousemove", "200", "150", "mousedown", b, "mousemove", "220", "156",
            "mousemove", "240", "165", "mouseup",   b};
  }
  void LeftDrag();
  void RightDrag();
  void MiddleDrag();
  void Wheel();
  /// Holds that the keys fly along these axes of the camera.
  void Fly(const std::vector<std::pair<const char*, Eigen::Vector3d>>& keys);
  void ThroughViews();
  void NearestView();
  void KindsOfImage();
  void Cameras();
  void Magnifier();
  void Comparisons();
  void HiddenView();
  void Marks();
  void TimeSteps();
  void AddsCameras();
  void LoadsAPath();
  void FliesAlongIt();
  void RecordsIt();
  void SavesImage();
  void SavesWindow();
  void CommandLine();
  void Panel();
  void Help();
  void Quit();
};

void Keys::LeftDrag() {
  const Json start = Now();
  const Json orbited = After(Drag(1), "an orbit", MovedFrom(start));
  EXPECT_GT(Turned(start, orbited), 1e-3);
  EXPECT_EQ(orbited["at_view"], "");
}

void Keys::RightDrag() {
  const Json start = Now();
  const Json looked = After(Drag(3), "another direction", TurnedFrom(start));
  EXPECT_LT(WayInCam(start, looked).norm(), 1e-9);
}

void Keys::MiddleDrag() {
  const Json start = Now();
  const Json panned = After(Drag(2), "another position", MovedFrom(start));
  EXPECT_LT(Turned(start, panned), 1e-9);
  const Eigen::Vector3d way = WayInCam(start, panned);
  EXPECT_LT(way.x(), 0) << "the scene follows the hand to the right";
  EXPECT_NEAR(way.z(), 0, 1e-9);
}

void Keys::Wheel() {
  const Json start = Now();
  const Json nearer = After({"mousemove", "200", "150", "click", "4"}, "nearer", MovedFrom(start));
  EXPECT_GT(WayInCam(start, nearer).z(), 0);
  EXPECT_EQ(nearer["fly_speed"], start["fly_speed"]);
  After({"click", "5"}, "back", MovedFrom(nearer));
  Do({"keydown", "d", "sleep", "0.3", "click", "4", "sleep", "0.3", "keyup", "d"});
  Wait("a higher speed", [&](const Json& s) {
    return s["fly_speed"].get<double>() > 1.1 * start["fly_speed"].get<double>();
  });
}

void Keys::Fly(const std::vector<std::pair<const char*, Eigen::Vector3d>>& keys) {
  for (const auto& [key, axis] : keys) {
    const Json start = Now();
    Press(key);
    const Json flown = Wait(key, MovedFrom(start));
    const Eigen::Vector3d way = WayInCam(start, flown);
    EXPECT_NEAR(way.normalized().dot(axis), 1, 1e-6) << key;
    EXPECT_LT(Turned(start, flown), 1e-9) << key;
  }
}

void Keys::ThroughViews() {
  Press("c");
  const Json start = Wait("an input camera", [](const Json& s) { return s["at_view"] != ""; });
  const std::string first = start["at_view"];
  const Json next = After({"key", "Right"}, "the next", [&](const Json& s) {
    return s["at_view"] != "" && s["at_view"] != first;
  });
  EXPECT_GT(WayInCam(start, next).norm(), 1e-3);
  AfterItIs({"key", "Left"}, "at_view", first);
}

void Keys::NearestView() {
  const Json at = Now();
  ASSERT_NE(at["at_view"], "");
  AfterItIs(Drag(1), "at_view", "");
  AfterItIs({"key", "c"}, "at_view", at["at_view"]);
}

void Keys::KindsOfImage() {
  AfterItIs({"key", "Down"}, "shown", "depth");
  AfterItIs({"key", "Down"}, "shown", "sigma");
  AfterItIs({"key", "Up"}, "shown", "depth");
  AfterItIs({"key", "Up"}, "shown", "colour");
}

void Keys::Cameras() {
  AfterItIs({"key", "f"}, "cameras", true);
  AfterItIs({"key", "f"}, "cameras", false);
}

void Keys::Magnifier() {
  After({"mousemove", "200", "150", "key", "g"}, "figures under the cursor",
        [](const Json& s) { return s["magnifier"].get<bool>() && !s["under_cursor"].empty(); });
  AfterItIs({"key", "g"}, "magnifier", false);
}

void Keys::Comparisons() {
  Press("w");  // off the input camera, where its photo would be all there is to see
  for (const char* compared : {"nearest photo", "other method", "other primitive", "nothing"}) {
    AfterItIs({"key", "x"}, "compared", compared);
  }
}

void Keys::HiddenView() {
  const Json hidden =
      After({"key", "h"}, "a view left out", [](const Json& s) { return !s["hidden"].empty(); });
  for (const Json& name : hidden["views_used"]) EXPECT_NE(name, hidden["hidden"][0]);
  const Json again =
      After({"key", "h"}, "taken in again", [](const Json& s) { return s["hidden"].empty(); });
  EXPECT_GT(again["views_used"].size(), hidden["views_used"].size());
}

void Keys::Marks() {
  After(
      {"mousemove", "150", "150", "key", "m", "sleep", "0.5", "mousemove", "260", "160", "key",
       "m"},
      "a distance", [](const Json& s) { return s["distance"] != ""; }, 20);
}

void Keys::TimeSteps() {
  const Json start = Now();
  EXPECT_EQ(start["time_steps"], 3);
  EXPECT_EQ(start["time_step"], 0);
  AfterItIs({"key", "n"}, "time_step", 1);
  AfterItIs({"key", "b"}, "time_step", 0);
  const Json last = AfterItIs({"key", "b"}, "time_step", 2);
  EXPECT_EQ(last["at_view"], start["at_view"]);
  EXPECT_LT(WayInCam(start, last).norm(), 1e-12) << "time passes, the camera stays";
  AfterItIs({"key", "n"}, "time_step", 0);
}

void Keys::AddsCameras() {
  Press("k");
  Wait("one camera", [](const Json& s) { return s["path_keys"] == 1; });
  Do({"key", "Right", "sleep", "1", "key", "k"});
  Wait("two cameras", [](const Json& s) { return s["path_keys"] == 2; });
  EXPECT_EQ(Json::parse(Text(In("moving-path-001.json")))["views"].size(), 2U);
}

void Keys::LoadsAPath() {
  const std::string path = WritePath("three-path-009.json", 3);
  AfterItIs({"key", "o"}, "asks_for_path", true);
  TypePath(path);
  Wait("a loaded path", [](const Json& s) { return s["path_keys"] == 3; });
}

void Keys::FliesAlongIt() {
  After({"key", "v"}, "all in view", [](const Json& s) { return s["at_view"] == ""; });
  After({"key", "space"}, "the end of the path",
        [](const Json& s) { return s["at_view"] == "0002.jpg"; });
}

void Keys::RecordsIt() {
  Press("r");
  const std::string video = In("moving-video-001.mp4");
  const Json end = Wait(
      "a video", [&](const Json& s) { return !s["recording"].get<bool>() && fs::exists(video); });
  EXPECT_EQ(end["time_step"], 2) << "a path runs through time";
  // Frame by frame what dtr render makes of the same cameras.
  DtrOk({"render", Set(), "--path", In("moving-video-001.json"), "-o", In("frames")});
  EXPECT_EQ(FilesIn(In("frames")), 3);
}

void Keys::SavesImage() {
  Press("p");
  Wait("an image", [&](const Json&) { return fs::exists(In("moving-image-001.png")); });
  EXPECT_EQ(io::ReadImage(In("moving-image-001.png")).width(), width_px_);
}

void Keys::SavesWindow() {
  WaitUntilStill();
  const ImageRgb8 shown = Screen();
  Press("F12");
  Wait("a window", [&](const Json&) { return fs::exists(In("moving-window-001.png")); });
  EXPECT_EQ(Differing(io::ReadImage(In("moving-window-001.png")), shown), 0);
}

void Keys::CommandLine() {
  Press("l");
  const Json state = Wait("a command line", [](const Json& s) {
    return s["message"].get<std::string>().starts_with("dtr render ");
  });
  const std::string command = state["message"];
  EXPECT_NE(command.find("--frame 2"), std::string::npos) << command;
  ASSERT_TRUE(RunProcess({"sh", "-c", std::string(DTR_PROGRAM) + command.substr(3)}, {}).Ok());
  EXPECT_EQ(Differing(io::ReadImage(In("moving-image-001.png")),
                      io::ReadImage(In("moving-camera-001.png"))),
            0)
      << command;
}

void Keys::Panel() {
  AfterItIs({"key", "Tab"}, "panel", true);
  AfterItIs({"key", "Tab"}, "panel", false);
}

void Keys::Help() {
  AfterItIs({"key", "question"}, "help", true);
  AfterItIs({"key", "F1"}, "help", false);
}

void Keys::Quit() {
  Press("ctrl+q");
  EXPECT_EQ(viewer_->WaitForEnd(), 0);
}

std::vector<Keys::Row> Keys::Rows() {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                        z = Eigen::Vector3d::UnitZ();
  return {
      {"left drag", [this] { LeftDrag(); }},
      {"right drag", [this] { RightDrag(); }},
      {"middle drag", [this] { MiddleDrag(); }},
      {"wheel", [this] { Wheel(); }},
      {"W A S D",
       [=, this] {
         Fly({{"w", z}, {"a", -x}, {"s", -z}, {"d", x}});
       }},
      {"E Q",
       [=, this] {
         Fly({{"e", -y}, {"q", y}});
       }},
      {"Right, Left", [this] { ThroughViews(); }},
      {"C", [this] { NearestView(); }},
      {"V",
       [this] {
         const Json start = Now();
         After({"key", "v"}, "all in view", MovedFrom(start));
         Press("c");
       }},
      {"Home",
       [this] {
         After({"key", "v"}, "all in view", [](const Json& s) { return s["at_view"] == ""; });
         After({"key", "Home"}, "the start", [](const Json& s) { return s["at_view"] != ""; });
       }},
      {"Down, Up", [this] { KindsOfImage(); }},
      {"F", [this] { Cameras(); }},
      {"G", [this] { Magnifier(); }},
      {"X", [this] { Comparisons(); }},
      {"H", [this] { HiddenView(); }},
      {"M", [this] { Marks(); }},
      {"T", [this] { ExpectPlays([] { Press("t"); }); }},
      {", .",
       [this] {
         After({"key", "comma"}, "half the speed",
               [](const Json& s) { return s["time_speed"] == 0.5; });
         After({"key", "period"}, "twice the speed",
               [](const Json& s) { return s["time_speed"] == 1; });
       }},
      {"N, B",
       [this] {
         while (Now()["time_step"] != 0) {
           const Json before = Now();
           After({"key", "n"}, "another",
                 [&](const Json& s) { return s["time_step"] != before["time_step"]; });
         }
         TimeSteps();
       }},
      {"K", [this] { AddsCameras(); }},
      {"O", [this] { LoadsAPath(); }},
      {"Space", [this] { FliesAlongIt(); }},
      {"R", [this] { RecordsIt(); }},
      {"P", [this] { SavesImage(); }},
      {"F12", [this] { SavesWindow(); }},
      {"L", [this] { CommandLine(); }},
      {"Tab", [this] { Panel(); }},
      {"? or F1", [this] { Help(); }},
      {"Ctrl Q", [this] { Quit(); }},
  };
}

TEST_F(Keys, EveryLineOfTheHelpIsTrue) {
  Open(400, 300, {"--no-panel"});
  if (IsSkipped()) return;
  const std::vector<Row> rows = Rows();
  std::set<std::string> helped, tested;
  for (const viewer::HelpLine& line : viewer::HelpLines()) helped.insert(line.keys);
  for (const Row& row : rows) tested.insert(row.keys);
  ASSERT_EQ(helped, tested) << "a line of the help without a test, or a test without a line";
  for (const Row& row : rows) {
    SCOPED_TRACE(row.keys);
    row.test();
    if (HasFatalFailure()) return;
  }
}

}  // namespace
}  // namespace dtr::testing
