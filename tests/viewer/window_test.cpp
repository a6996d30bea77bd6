// `dtr view` in a real window: keys, drags and the wheel by xdotool.
#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "tests/support/environment.h"
#include "tests/viewer/viewer_window.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = ViewerWindow::Json;
using ::testing::HasSubstr;

TEST_F(ViewerWindow, KeysDragsAndTheWheelMoveTheCamera) {
  NeedDisplay();
  if (IsSkipped()) return;
  ViewerProgram viewer(Set(), folder_.path(), {"--size", "600x400", "--no-panel"});
  const Json start = viewer.WaitFor("the first image", Anything);
  EXPECT_EQ(start["at_view"], "0003.jpg") << "the camera in the middle";
  EXPECT_EQ(start["width_px"], 600);
  EXPECT_GT(start["coverage"], 0.5);
  EXPECT_EQ(start["divisor"], 1);

  ViewerProgram::Do({"mousemove", "300", "220", "key", "Right"});
  const Json next = viewer.WaitFor("the next input camera",
                                   [](const Json& s) { return s["at_view"] == "0004.jpg"; });
  EXPECT_GT(Moved(start, next), 0.01);
  ViewerProgram::Do({"key", "Left"});
  viewer.WaitFor("the input camera before",
                 [](const Json& s) { return s["at_view"] == "0003.jpg"; });

  ViewerProgram::Do(
      {"mousedown", "1", "mousemove", "340", "230", "mousemove", "380", "240", "mouseup", "1"});
  const Json orbited = viewer.WaitFor("an orbit", MovedFrom(start));
  EXPECT_EQ(orbited["at_view"], "");

  ViewerProgram::Do({"mousemove", "300", "220", "click", "4"});
  const Json nearer = viewer.WaitFor("the wheel", MovedFrom(orbited));
  ViewerProgram::Do({"key", "w"});
  const Json flown = viewer.WaitFor("a flight", MovedFrom(nearer));
  ViewerProgram::Do({"key", "v"});
  const Json all = viewer.WaitFor("all in view", MovedFrom(flown));
  ViewerProgram::Do({"key", "c"});
  const Json back =
      viewer.WaitFor("the nearest input camera", [](const Json& s) { return s["at_view"] != ""; });
  EXPECT_GT(Moved(all, back), 0.01);

  ViewerProgram::Do({"key", "question"});
  viewer.WaitFor("help", [](const Json& s) { return s["help"].get<bool>(); });
  ViewerProgram::Do({"key", "F1"});
  viewer.WaitFor("no help", [](const Json& s) { return !s["help"].get<bool>(); });
  ViewerProgram::Do({"key", "ctrl+q"});
  EXPECT_EQ(viewer.WaitForEnd(), 0);
}

TEST_F(ViewerWindow, TheCommandLineDrawsThePictureInTheWindow) {
  NeedDisplay();
  if (IsSkipped()) return;
  for (const auto& options : std::vector<std::vector<std::string>>{
           {},
           {"--views", "3", "--fill-holes=false", "--blend", "cosine", "--max-angle", "50"},
           // One view fits: without its words the command would draw from more.
           {"--memory", "0.0003"}}) {
    std::vector<std::string> args{"--size", "320x240", "--no-panel"};
    args.insert(args.end(), options.begin(), options.end());
    const TemporaryFolder folder;
    ViewerProgram viewer(Set(), folder.path(), args);
    const Json start = viewer.WaitFor("the first image", Anything);
    ViewerProgram::Do(
        {"mousemove", "150", "120", "mousedown", "1", "mousemove", "170", "124", "mouseup", "1"});
    viewer.WaitFor("an orbit", MovedFrom(start));
    ViewerProgram::Do({"key", "p"});
    const fs::path picture = folder / "good-image-001.png";
    viewer.WaitFor("a saved image", [&](const Json&) { return fs::exists(picture); });
    ViewerProgram::Do({"key", "l"});
    const Json state = viewer.WaitFor("a command line", [](const Json& s) {
      return s["message"].get<std::string>().starts_with("dtr render ");
    });
    const std::string command = state["message"].get<std::string>();
    for (const std::string& option : options) EXPECT_THAT(command, HasSubstr(option));
    const std::string run = std::string(DTR_PROGRAM) + command.substr(3);
    ASSERT_TRUE(RunProcess({"sh", "-c", run}, {}).Ok()) << run;
    EXPECT_EQ(io::ReadImage(folder / "good-camera-001.png").data(), io::ReadImage(picture).data())
        << command;
    EXPECT_EQ(Text(folder / "good-camera-001.png"), Text(picture)) << "alpha";
  }
}

TEST_F(ViewerWindow, APathIsRecordedThatRenderAndViewRead) {
  NeedDisplay();
  if (IsSkipped()) return;
  const std::string path = In("good-path-001.json");
  {
    ViewerProgram viewer(Set(), folder_.path(),
                         {"--size", "320x240", "--no-panel", "--like", "0001"});
    viewer.WaitFor("the first image", Anything);
    ViewerProgram::Do({"mousemove", "150", "120", "key", "k"});
    viewer.WaitFor("a path", [&](const Json&) { return fs::exists(path); });
    ViewerProgram::Do({"key", "Right"});
    viewer.WaitFor("the next view", [](const Json& s) { return s["at_view"] == "0002.jpg"; });
    const auto one = Text(path);
    ViewerProgram::Do({"key", "k"});
    viewer.WaitFor("a longer path", [&](const Json&) { return Text(path) != one; });
  }
  DtrOk({"render", Set(), "--path", path, "-o", In("frames")});
  EXPECT_EQ(FilesIn(In("frames")), 2);
  const Ran ran = DtrOk({"view", Set(), "--path", path, "--frames", "2", "--json", "-", "-o",
                         folder_.path().string()});
  EXPECT_EQ(Json::parse(ran.out)["last"]["at_view"], "0002.jpg");
}

TEST_F(ViewerWindow, APathIsLoadedAndFilmedInTheWindow) {
  NeedDisplay();
  if (IsSkipped()) return;
  if (FindProgram("ffmpeg").empty()) GTEST_SKIP() << "ffmpeg is missing";
  const std::string path = In("two-path-001.json");
  {
    const Json cameras =
        Json::parse(Text(fs::path(Set()).parent_path() / "courtyard" / "cameras.json"));
    Json two = cameras;
    two["views"] = Json::array({cameras["views"][1], cameras["views"][3]});
    WriteFileAtomically(path, two.dump());
  }
  ViewerProgram viewer(Set(), folder_.path(), {"--size", "162x122", "--no-panel"});
  viewer.WaitFor("the first image", Anything);
  ViewerProgram::Do({"mousemove", "80", "60", "key", "r"});
  const Json none = viewer.WaitFor("no path to film", [](const Json& s) {
    return s["message"].get<std::string>().starts_with("a video needs a path");
  });
  EXPECT_FALSE(none["recording"].get<bool>());
  const auto load = [](const std::string& file) {
    ViewerProgram::Do({"key", "o", "sleep", "0.5", "type", "--delay", "20", file});
    ViewerProgram::Do({"key", "Return"});
  };
  load(In("absent.json"));
  viewer.WaitFor("a rejection", [](const Json& s) {
    return s["message"].get<std::string>().find("absent.json") != std::string::npos;
  });
  load(path);
  viewer.WaitFor("a path", [](const Json& s) { return s["path_keys"] == 2; });
  ViewerProgram::Do({"key", "r"});
  const std::string video = In("good-video-001.mp4");
  viewer.WaitFor("a video",
                 [&](const Json& s) { return !s["recording"].get<bool>() && fs::exists(video); });
  DtrOk({"render", Set(), "--path", In("good-video-001.json"), "-o", In("frames")});
  EXPECT_EQ(FilesIn(In("frames")), 2);
  std::string probed;
  ProcessOptions listen;
  listen.on_line = [&](const std::string& line) { probed += line; };
  EXPECT_TRUE(RunProcess({"ffprobe", "-v", "error", "-count_frames", "-show_entries",
                          "stream=width,height,nb_read_frames", "-of", "csv=p=0", video},
                         listen)
                  .Ok());
  EXPECT_EQ(probed, "162,122,2");
  EXPECT_EQ(io::ReadImage(In("frames") + "/good-video-001-0001.png").width(), 162);
  ViewerProgram::Do({"key", "space"});
  viewer.WaitFor("the end of a flight", [](const Json& s) { return s["at_view"] == "0003.jpg"; });
}

TEST_F(ViewerWindow, TheSetOnTheDiskIsReadAnewAndItsLossIsNoCrash) {
  NeedDisplay();
  if (IsSkipped()) return;
  const fs::path set = In("mine.dtr");
  fs::copy(Set(), set, fs::copy_options::recursive);
  // Filling would keep the photos in memory.
  ViewerProgram viewer(set, folder_.path(),
                       {"--size", "320x240", "--no-panel", "--fill-holes=false", "--like", "0001"});
  viewer.WaitFor("the first image", Anything);
  ViewerProgram::Do({"mousemove", "150", "120", "key", "Right"});
  viewer.WaitFor("another view", [](const Json& s) { return s["at_view"] == "0002.jpg"; });
  const std::string good = Text(set / "set.json");

  WriteFileAtomically(set / "set.json", good.substr(0, good.size() / 2));
  const Json broken = viewer.WaitFor("word of a broken set", [](const Json& s) {
    return s["message"].get<std::string>().find("set.json") != std::string::npos;
  });
  EXPECT_EQ(broken["at_view"], "0002.jpg");
  EXPECT_GT(broken["coverage"], 0.5);

  fs::rename(set, In("away.dtr"));
  viewer.WaitFor("word of a set that vanished", [](const Json& s) {
    return s["message"].get<std::string>().find("found nothing") != std::string::npos;
  });
  ViewerProgram::Do({"key", "Left"});  // it goes on with what it has
  viewer.WaitFor("a view before", [](const Json& s) { return s["at_view"] == "0001.jpg"; });
  ViewerProgram::Do({"key", "g"});  // wants the photos themselves
  const Json refused = viewer.WaitFor("word of lost pixels", [](const Json& s) {
    return s["message"].get<std::string>().find("be read") != std::string::npos;
  });
  EXPECT_FALSE(refused["magnifier"].get<bool>());
  EXPECT_GT(refused["coverage"], 0.5);

  Json without = Json::parse(good);  // comes back with one view less
  Json& views = without["frames"][0]["views"];
  for (size_t i = 0; i < views.size(); ++i) {
    if (views[i]["name"] == "0003.jpg") views.erase(i);
  }
  WriteFileAtomically(In("away.dtr/set.json"), without.dump());
  fs::rename(In("away.dtr"), set);
  const Json anew = viewer.WaitFor("the new set", [](const Json& s) { return s["reloads"] == 1; });
  EXPECT_EQ(anew["at_view"], "0001.jpg");  // the camera stays
  for (const Json& name : anew["views_used"]) EXPECT_NE(name, "0003.jpg");
  EXPECT_FALSE(anew["views_used"].empty());
}

TEST_F(ViewerWindow, WhatIsInspectedIsSaid) {
  NeedDisplay();
  if (IsSkipped()) return;
  ViewerProgram viewer(Set(), folder_.path(),
                       {"--size", "400x300", "--no-panel", "--like", "0001"});
  viewer.WaitFor("the first image", Anything);
  ViewerProgram::Do({"mousemove", "200", "200", "key", "g"});
  const Json probed = viewer.WaitFor("figures under the cursor",
                                     [](const Json& s) { return !s["under_cursor"].empty(); });
  EXPECT_EQ(probed["under_cursor"][0], "0001.jpg");  // at its place nothing weighs more
  ViewerProgram::Do({"key", "h"});
  const Json hidden = viewer.WaitFor("a view left out", [](const Json& s) {
    return s["hidden"] == Json::array({"0001.jpg"}) && !s["under_cursor"].empty();
  });
  EXPECT_NE(hidden["under_cursor"][0], "0001.jpg");
  for (const Json& name : hidden["views_used"]) EXPECT_NE(name, "0001.jpg");
  ViewerProgram::Do({"key", "m", "mousemove", "260", "210", "key", "m"});
  const Json measured =
      viewer.WaitFor("a distance", [](const Json& s) { return s["distance"] != ""; });
  EXPECT_FALSE(measured["distance"].get<std::string>().starts_with("0 "));
  for (const char* compared : {"nearest photo", "other method", "other primitive", "nothing"}) {
    ViewerProgram::Do({"key", "x"});
    viewer.WaitFor(compared, [&](const Json& s) { return s["compared"] == compared; });
  }
  for (const char* shown :
       {"depth", "sigma", "weights", "view count", "coverage", "wireframe", "colour"}) {
    ViewerProgram::Do({"key", "Down"});
    viewer.WaitFor(shown, [&](const Json& s) { return s["shown"] == shown; });
  }
  ViewerProgram::Do({"key", "f"});
  viewer.WaitFor("cameras", [](const Json& s) { return s["cameras"].get<bool>(); });
  EXPECT_EQ(viewer.WaitFor("no complaint", Anything)["message"], "");
}

TEST_F(ViewerWindow, PixelsGoOnceTheyAreSampledAndComeBackForWhoLooksAtThem) {
  NeedDisplay();
  if (IsSkipped()) return;
  const auto bytes = [&](const std::vector<std::string>& further) {
    std::vector<std::string> words{
        "view", Set(),    "--size", "320x240", "--no-panel",           "--frames",
        "1",    "--json", "-",      "-o",      folder_.path().string()};
    words.insert(words.end(), further.begin(), further.end());
    const Json json = Json::parse(DtrOk(words).out);
    return std::pair(json["view_bytes"].get<size_t>(), json["view_bytes_held"].get<size_t>());
  };
  const auto [decoded, held] = bytes({});
  EXPECT_GT(decoded, 0u);
  EXPECT_EQ(held, 0u) << "the display's OpenGL draws on the processor";
  EXPECT_EQ(bytes({"--photo"}), std::pair(decoded, size_t{0})) << "the photo is read by itself";

  ViewerProgram viewer(Set(), folder_.path(), {"--size", "320x240", "--no-panel"});
  viewer.WaitFor("the first image", Anything);
  int saved = 0;
  const auto save = [&] {
    const fs::path file = In("good-image-00" + std::to_string(++saved) + ".png");
    ViewerProgram::Do({"key", "p"});
    viewer.WaitFor("a saved image", [&](const Json&) { return fs::exists(file); });
    return io::ReadImage(file);
  };
  ViewerProgram::Do({"mousemove", "160", "120"});
  const ImageRgb8 first = save();
  ViewerProgram::Do({"key", "g"});
  viewer.WaitFor("figures under the cursor",
                 [](const Json& s) { return !s["under_cursor"].empty(); });
  ViewerProgram::Do({"key", "g"});
  viewer.WaitFor("no magnifier", [](const Json& s) { return s["under_cursor"].empty(); });
  ViewerProgram::Do({"key", "Down"});
  viewer.WaitFor("depth", [](const Json& s) { return s["shown"] == "depth"; });
  ViewerProgram::Do({"key", "Up"});
  viewer.WaitFor("colour", [](const Json& s) { return s["shown"] == "colour"; });
  EXPECT_EQ(save().data(), first.data());
  EXPECT_EQ(viewer.WaitFor("no complaint", Anything)["message"].get<std::string>().find("cannot"),
            std::string::npos);
}

TEST_F(ViewerWindow, ThePanelTakesItsClicksAndTheWindowIsSaved) {
  NeedDisplay();
  if (IsSkipped()) return;
  ViewerProgram viewer(Set(), folder_.path(), {"--size", "900x700"});
  const Json start = viewer.WaitFor("the first image", Anything);
  EXPECT_TRUE(start["panel"].get<bool>());
  ViewerProgram::Do({"mousemove", "100", "690", "mousedown", "1", "mousemove", "200", "690",
                     "mouseup", "1", "click", "4"});
  ViewerProgram::Do({"mousemove", "700", "400", "key", "Down"});
  const Json depth = viewer.WaitFor("depth", [](const Json& s) { return s["shown"] == "depth"; });
  EXPECT_EQ(Moved(start, depth), 0) << "a drag on the panel moved the camera";
  ViewerProgram::Do({"key", "F12"});
  const fs::path first = In("good-window-001.png"), second = In("good-window-002.png");
  viewer.WaitFor("a saved window", [&](const Json&) { return fs::exists(first); });
  ViewerProgram::Do({"key", "Tab"});
  viewer.WaitFor("no panel", [](const Json& s) { return !s["panel"].get<bool>(); });
  ViewerProgram::Do({"key", "F12"});
  viewer.WaitFor("another", [&](const Json&) { return fs::exists(second); });
  const ImageRgb8 with = io::ReadImage(first), without = io::ReadImage(second);
  ASSERT_EQ(with.width(), 900);
  int left = 0, right = 0;  // of the panel's right border, away from the line at the foot
  for (int y = 0; y < 600; ++y) {
    for (int x = 0; x < 900; ++x) (x < 340 ? left : right) += with(x, y) != without(x, y);
  }
  EXPECT_GT(left, 50000);
  EXPECT_EQ(right, 0);
}

TEST_F(ViewerWindow, AFlightIsTimedAndItsEndIsSaved) {
  NeedDisplay();
  if (IsSkipped()) return;
  const Ran ran =
      DtrOk({"view", Set(), "--size", "320x240", "--fly-through", "12", "--frames", "20", "-o",
             folder_.path().string(), "--screenshot", In("end.png"), "--json", "-"});
  const Json json = Json::parse(ran.out);
  EXPECT_GE(json["frames"], 20);
  EXPECT_GE(json["moving"]["frames"], 10);
  EXPECT_GT(json["moving"]["fps"], 0);
  EXPECT_GT(json["first_frame_ms"], 0);
  EXPECT_GT(json["first_whole_frame_ms"], json["first_frame_ms"]) << "at the flight's end";
  EXPECT_TRUE(json["last"]["still"].get<bool>());
  EXPECT_EQ(io::ReadImage(In("end.png")).height(), 240);
}

TEST_F(ViewerWindow, ASetWhoseCalibrationFailedItsTestsSaysSo) {
  const fs::path copy = folder_ / "failed.dtr";
  fs::copy(Set(), copy, fs::copy_options::recursive);
  DtrSet set = io::ReadSet(copy);
  set.validation_json =
      R"({"passed":false,"tests":[{"name":"held_out_rms_px","passed":false,"value":9,"limit":1}]})";
  io::RewriteMetadata(copy, set);
  const char* warning = "WARNING: validation FAILED: held_out_rms_px";
  {
    const Environment no_display("DISPLAY", "");
    EXPECT_THAT(Dtr({"view", copy.string()}).err, HasSubstr(warning));
    EXPECT_THAT(Dtr({"view", Set()}).err, ::testing::Not(HasSubstr("WARNING: calibration")));
  }
  NeedDisplay();
  if (IsSkipped()) return;
  const Json json = Json::parse(
      DtrOk({"view", copy.string(), "--size", "320x240", "--frames", "3", "--json", "-"}).out);
  EXPECT_THAT(json["last"]["message"], HasSubstr(warning));
}

TEST_F(ViewerWindow, WhatCannotWorkIsSaidInOneLine) {
  {
    const Environment no_display("DISPLAY", "");
    ExpectRejected(Dtr({"view", Set()}), kFailed,
                   "window: expected a display to open it on, found none");
    EXPECT_THAT(Dtr({"view", Set()}).err, HasSubstr("dtr render"));
  }
  ExpectRejected(Dtr({"view", In("absent.dtr")}), kFailed,
                 "expected the folder of a D+TR set, found nothing");
  ExpectRejected(Dtr({"view", Set(), "--screenshot", In("a.png")}), kWrongUsage,
                 "--screenshot: expected --frames N with it");
  ExpectRejected(Dtr({"view", Set(), "-o", In("absent")}), kWrongUsage,
                 "expected a folder to save into, found none");
  NeedDisplay();
  if (IsSkipped()) return;
  const Environment old("MESA_GL_VERSION_OVERRIDE", "3.3");
  ExpectRejected(Dtr({"view", Set()}), kFailed,
                 "window: expected OpenGL 4.3 or newer on this display");
}

}  // namespace
}  // namespace dtr::testing
