// `dtr view` in a real window: the commands it gives, the photos it reads, the files it leaves.
#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "tests/viewer/viewer_window.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = ViewerWindow::Json;
using ::testing::HasSubstr;

/// `set` as `dtr prune` leaves it, for these options.
void PruneFor(const fs::path& set, const std::vector<std::string>& arguments) {
  Json json = Json::parse(Text(set / "set.json"));
  json["pruned"]["render_arguments"] = arguments;
  WriteFileAtomically(set / "set.json", json.dump());
}

TEST_F(ViewerWindow, TheCommandLineOfAPrunedSetSaysWhatDiffersFromItsOwnOptions) {
  NeedDisplay();
  if (IsSkipped()) return;
  const fs::path set = In("mine.dtr");
  fs::copy(Set(), set, fs::copy_options::recursive);
  PruneFor(set, {"--views", "2", "--blend", "cosine", "--fill-holes", "--absolute-delta", "3"});
  struct Case {
    std::vector<std::string> options, words;
  };
  // Those of the library are no defaults here.
  for (const Case& one :
       std::vector<Case>{{{}, {}},
                         {{"--views", "8", "--fill-holes=false", "--absolute-delta", "0"},
                          {"--views 8", "--fill-holes=false", "--absolute-delta 0"}}}) {
    const TemporaryFolder folder;
    std::vector<std::string> args{"--size", "320x240", "--no-panel", "--like", "0001"};
    args.insert(args.end(), one.options.begin(), one.options.end());
    ViewerProgram viewer(set, folder.path(), args);
    viewer.WaitFor("the first image", Anything);
    ViewerProgram::Do({"mousemove", "150", "120", "key", "Right"});
    viewer.WaitFor("the next view", [](const Json& s) { return s["at_view"] == "0002.jpg"; });
    ViewerProgram::Do({"key", "p"});
    const fs::path picture = folder / "mine-image-001.png";
    viewer.WaitFor("a saved image", [&](const Json&) { return fs::exists(picture); });
    ViewerProgram::Do({"key", "l"});
    const std::string command = viewer.WaitFor("a command line", [](const Json& s) {
      return s["message"].get<std::string>().starts_with("dtr render ");
    })["message"];
    for (const std::string& words : one.words) EXPECT_THAT(command, HasSubstr(words));
    EXPECT_EQ(command.find("--views") == std::string::npos, one.words.empty()) << command;
    EXPECT_EQ(command.find("--blend"), std::string::npos) << command;
    const std::string run = std::string(DTR_PROGRAM) + command.substr(3);
    ASSERT_TRUE(RunProcess({"sh", "-c", run}, {}).Ok()) << run;
    EXPECT_EQ(io::ReadImage(folder / "mine-camera-001.png").data(), io::ReadImage(picture).data())
        << command;
  }
}

TEST_F(ViewerWindow, TheDefaultsOfAPrunedSetAreItsOwn) {
  VirtualDisplay tall("600x1500x24");  // the panel as a whole
  if (!tall.up() || FindProgram("xdotool").empty()) GTEST_SKIP() << "no display, or no xdotool";
  const fs::path set = In("mine.dtr");
  fs::copy(Set(), set, fs::copy_options::recursive);
  PruneFor(set, {"--views", "2", "--fill-holes"});
  ViewerProgram viewer(set, folder_.path(), {"--size", "500x1400", "--views", "5"});
  const auto place_of = [](const Json& state) {
    for (const Json& control : state["controls"]) {
      if (control["name"] == "defaults" && control["visible"].get<bool>()) return control;
    }
    return Json();
  };
  const Json start = viewer.WaitFor("the button", [&](const Json& s) {
    return !place_of(s).is_null() && s["render_options"] == Json{"--views", "5"};
  });
  const Json button = place_of(start);
  ViewerProgram::Do({"mousemove", std::to_string(std::lround(button["x"].get<double>() + 20)),
                     std::to_string(std::lround(button["y"].get<double>() + 8)), "sleep", "0.1",
                     "mousedown", "1", "sleep", "0.1", "mouseup", "1"});
  viewer.WaitFor("the set's own options", [](const Json& s) {
    return s["render_options"] == Json{"--views", "2"};
  });
}

TEST_F(ViewerWindow, TheCommandLineSaysWhatItDoesNotDraw) {
  NeedDisplay();
  if (IsSkipped()) return;
  ViewerProgram viewer(Set(), folder_.path(), {"--size", "320x240", "--no-panel"});
  viewer.WaitFor("the first image", Anything);
  int made = 0;
  const auto command_of = [&](const std::string& shown) {
    viewer.WaitFor(shown, [&](const Json& s) { return s["shown"] == shown; });
    ViewerProgram::Do({"key", "l"});
    const std::string file = "good-camera-00" + std::to_string(++made) + ".json";
    const std::string said = viewer.WaitFor("a command", [&](const Json& s) {
      return s["message"].get<std::string>().find(file) != std::string::npos;
    })["message"];
    const std::string run = std::string(DTR_PROGRAM) + said.substr(3, said.find('\n') - 3);
    EXPECT_TRUE(RunProcess({"sh", "-c", run}, {}).Ok()) << run;
    return said;
  };
  ViewerProgram::Do({"mousemove", "160", "120", "key", "Down"});
  EXPECT_THAT(command_of("depth"), HasSubstr("beside them the depth"));
  EXPECT_TRUE(fs::exists(In("good-camera-001-depth.exr")));
  ViewerProgram::Do({"key", "Down"});
  EXPECT_THAT(command_of("sigma"), HasSubstr("sigma is the window's own"));
  ViewerProgram::Do({"key", "Down", "key", "Down", "key", "Down"});
  EXPECT_THAT(command_of("coverage"), HasSubstr("beside them the coverage"));
  EXPECT_TRUE(fs::exists(In("good-camera-003-coverage.png")));
  ViewerProgram::Do({"key", "Down", "key", "Down", "key", "x"});
  viewer.WaitFor("a photo", [](const Json& s) { return s["photo"] != ""; });
  EXPECT_THAT(command_of("colour"), HasSubstr("left of the border"));
}

TEST_F(ViewerWindow, PhotosAreThereOfHiddenAndHeldOutViewsToo) {
  NeedDisplay();
  if (IsSkipped()) return;
  ViewerProgram viewer(Set(), folder_.path(),
                       {"--size", "320x240", "--no-panel", "--photo", "--cameras", "--exclude",
                        "0001", "--like", "0001"});
  const Json start =
      viewer.WaitFor("its photo", [](const Json& s) { return s["photo"] == "0001.jpg"; });
  EXPECT_EQ(start["hidden"], Json::array({"0001.jpg"})) << "left out, and to be taken in again";
  for (const Json& name : start["views_used"]) EXPECT_NE(name, "0001.jpg");
  const size_t cameras =
      Json::parse(Text(fs::path(Set()) / "set.json"))["frames"][0]["views"].size();
  viewer.WaitFor("photos of all cameras",
                 [&](const Json& s) { return s["thumbnails"].get<size_t>() == cameras; });
  ViewerProgram::Do({"mousemove", "160", "120", "key", "Left"});
  const Json held_out =
      viewer.WaitFor("a held-out photo", [](const Json& s) { return s["photo"] == "0000.jpg"; });
  EXPECT_EQ(held_out["at_view"], "0000.jpg");
  EXPECT_TRUE(held_out["at_held_out"].get<bool>());
  for (const Json& name : held_out["views_used"]) EXPECT_NE(name, "0000.jpg");
  ViewerProgram::Do({"key", "Right", "key", "h"});
  viewer.WaitFor("it drawn from again", [](const Json& s) {
    return s["hidden"].empty() && s["at_view"] == "0001.jpg" &&
           std::count(s["views_used"].begin(), s["views_used"].end(), "0001.jpg") == 1;
  });
}

TEST_F(ViewerWindow, AHandThatHoldsStillInADragWaitsForNoWholePicture) {
  NeedDisplay();
  if (IsSkipped()) return;
  ViewerProgram viewer(Set(), folder_.path(), {"--size", "320x240", "--no-panel"});
  const Json start = viewer.WaitFor("the first image", Anything);
  ViewerProgram::Do(
      {"mousemove", "150", "120", "mousedown", "1", "mousemove", "180", "124", "sleep", "1.5"});
  const Json held = viewer.WaitFor("what was", Anything);
  EXPECT_EQ(Moved(start, held), 0) << "a whole image in the middle of a drag";
  ViewerProgram::Do({"mouseup", "1"});
  viewer.WaitFor("a whole image of the new position", MovedFrom(start));
}

TEST_F(ViewerWindow, AFolderThatGoesAwayIsToldOf) {
  NeedDisplay();
  if (IsSkipped()) return;
  const fs::path output = In("output");
  fs::create_directory(output);
  ViewerProgram viewer(Set(), folder_.path(), {"--size", "320x240", "--no-panel"}, output);
  viewer.WaitFor("the first image", Anything);
  fs::remove(output);
  fs::create_symlink("output", output);  // leads to itself: not even its absence can be told
  int told = 0;
  for (const char* key : {"p", "F12", "l", "k"}) {
    ViewerProgram::Do({"mousemove", std::to_string(100 + told++), "120", "key", key});
    viewer.WaitFor(std::string("word of no position for ") + key, [](const Json& s) {
      return s["message"].get<std::string>().find("symbolic links") != std::string::npos;
    });
    ViewerProgram::Do({"key", "r"});  // another message
    viewer.WaitFor("another message", [&](const Json& s) {
      return s["message"].get<std::string>().find("symbolic links") == std::string::npos ||
             key == std::string("k");
    });
  }
  fs::remove(output);
  fs::create_directory(output);
  ViewerProgram::Do({"key", "p"});
  viewer.WaitFor("an image",
                 [&](const Json&) { return fs::exists(output / "good-image-001.png"); });
}

TEST_F(ViewerWindow, CtrlQQuitsOutOfATextFieldAndARecording) {
  NeedDisplay();
  if (IsSkipped()) return;
  if (FindProgram("ffmpeg").empty()) GTEST_SKIP() << "ffmpeg is missing";
  {
    ViewerProgram viewer(Set(), folder_.path(), {"--size", "320x240", "--no-panel"});
    viewer.WaitFor("the first image", Anything);
    ViewerProgram::Do({"mousemove", "160", "120", "key", "o"});
    viewer.WaitFor("a text field", [](const Json& s) { return s["asks_for_path"].get<bool>(); });
    ViewerProgram::Do({"sleep", "0.5", "type", "--delay", "20", "abc"});
    ViewerProgram::Do({"key", "ctrl+q"});
    EXPECT_EQ(viewer.WaitForEnd(), 0);
  }
  const fs::path recorded = In("recorded");  // where no other viewer left its state
  fs::create_directories(recorded);
  const auto videos = [&] {
    int count = 0;
    for (const auto& entry : fs::directory_iterator(recorded)) {
      count += entry.path().filename().string().find("-video-") != std::string::npos;
    }
    return count;
  };
  ViewerProgram viewer(Set(), recorded, {"--size", "320x240", "--no-panel"});
  viewer.WaitFor("the first image", Anything);
  ViewerProgram::Do({"mousemove", "160", "120"});
  for (int key = 1; key <= 5; ++key) {  // long enough not to be done before it is left
    ViewerProgram::Do({"key", "k"});
    viewer.WaitFor("a longer path", [&](const Json& s) { return s["path_keys"] == key; });
    ViewerProgram::Do({"key", "Right", "sleep", "1"});
  }
  ViewerProgram::Do({"key", "r"});
  viewer.WaitFor("a recording", [](const Json& s) { return s["recording"].get<bool>(); });
  EXPECT_GT(videos(), 0) << "the cameras of its frames, and the frames";
  ViewerProgram::Do({"key", "ctrl+q"});
  EXPECT_EQ(viewer.WaitForEnd(), 0);
  EXPECT_EQ(videos(), 0);
}

TEST_F(ViewerWindow, ACommaInANameEndsItInNoCommandLine) {
  NeedDisplay();
  if (IsSkipped()) return;
  const fs::path set = In("mine.dtr");
  fs::copy(Set(), set, fs::copy_options::recursive);
  Json json = Json::parse(Text(set / "set.json"));
  for (Json& view : json["frames"][0]["views"]) {
    if (view["name"] == "0001.jpg") view["name"] = "one, and only.jpg";
  }
  WriteFileAtomically(set / "set.json", json.dump());
  ViewerProgram viewer(set, folder_.path(),
                       {"--size", "320x240", "--no-panel", "--like", "one, and only.jpg"});
  viewer.WaitFor("the first image", Anything);
  ViewerProgram::Do({"mousemove", "160", "120", "key", "h"});
  viewer.WaitFor("a view left out", [](const Json& s) { return s["hidden"].size() == 1; });
  ViewerProgram::Do({"key", "l"});
  const std::string command = viewer.WaitFor("a command line", [](const Json& s) {
    return s["message"].get<std::string>().starts_with("dtr render ");
  })["message"];
  EXPECT_THAT(command, HasSubstr("--exclude 0001"));
  const std::string run = std::string(DTR_PROGRAM) + command.substr(3);
  EXPECT_TRUE(RunProcess({"sh", "-c", run}, {}).Ok()) << run;
}

}  // namespace
}  // namespace dtr::testing
