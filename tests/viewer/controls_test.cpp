// Every control of the viewer's panel, in a real window: what is done, and what must have changed.
#include <optional>
#include <set>

#include "tests/viewer/moving_window.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// After this word in the state's render_options; none where the option has its default.
std::optional<std::string> Option(const Json& state, const std::string& word) {
  const Json& words = state["render_options"];
  for (size_t i = 0; i < words.size(); ++i) {
    if (words[i] == word) return i + 1 < words.size() ? words[i + 1].get<std::string>() : "";
  }
  return std::nullopt;
}

class Controls : public MovingWindow {
 protected:
  struct Row {
    std::string control;
    std::function<void()> test;
  };
  /// A state, of which the controls that it has are remembered.
  Json Look(const std::string& what, const std::function<bool(const Json&)>& holds) {
    const Json state = Wait(what, holds);
    for (const Json& control : state["controls"]) {
      // Entries of lists are tried with their lists.
      const std::string name = control["name"];
      if (name.find('=') == std::string::npos) seen_.insert(name);
    }
    return state;
  }
  Json Look() {
    return Look("a whole image", [](const Json&) { return true; });
  }
  static bool Has(const Json& state, const std::string& name, bool visible = false) {
    for (const Json& control : state["controls"]) {
      if (control["name"] == name) return !visible || control["visible"].get<bool>();
    }
    return false;
  }
  /// Clicks at this share of the control's width.
  void Click(const std::string& name, double share = 0.5) {
    const auto there = [&](const Json& s) { return Has(s, name, true); };
    Look(name + ", not scrolled out of the panel", there);
    // A list that drops down is laid out before it is seen, and moves until it fits.
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    const Json state = Look(name + ", still there", there);
    for (const Json& control : state["controls"]) {
      if (control["name"] != name) continue;
      const double x = control["x"].get<double>() + share * control["width"].get<double>();
      const double y = control["y"].get<double>() + 0.5 * control["height"].get<double>();
      Do({"mousemove", std::to_string(std::lround(x)), std::to_string(std::lround(y)), "sleep",
          "0.1", "mousedown", "1", "sleep", "0.1", "mouseup", "1"});
    }
  }
  /// Takes an entry of a list.
  void Choose(const std::string& list, const std::string& entry) {
    Click(list);
    Click(list + "=" + entry);
    Look("a closed list", [&](const Json& s) { return !Has(s, list + "=" + entry); });
  }
  Json ClickUntil(const std::string& name, const std::function<bool(const Json&)>& holds,
                  int pixels = 10) {
    const ImageRgb8 before = Screen();
    Click(name);
    const Json state = Look(name, holds);
    ExpectScreenChanges(before, pixels, name);
    return state;
  }
  Json ClickUntilItIs(const std::string& name, const std::string& field, const Json& value) {
    return ClickUntil(name, [&](const Json& s) { return s[field] == value; });
  }

  /// A slider towards both of its ends, of an option by this word.
  void Slide(const std::string& name, const std::string& word) {
    // Of whole numbers, too, not where the slider begins; 0.35 is the default of max-angle.
    Click(name, 0.3);
    const Json low = Look(name, [&](const Json& s) { return Option(s, word).has_value(); });
    Click(name, 0.85);
    Look(name + " to the right", [&](const Json& s) {
      return Option(s, word) && std::stod(*Option(s, word)) > std::stod(*Option(low, word));
    });
  }
  /// A box that is ticked and not, of an option without a value.
  void Tick(const std::string& name, const std::string& word) {
    ClickUntil(name, [&](const Json& s) { return Option(s, word).has_value(); });
    ClickUntil(name, [&](const Json& s) { return !Option(s, word).has_value(); });
  }
  void ClickUntilOption(const std::string& name, const std::string& word) {
    ClickUntil(name, [&](const Json& s) { return Option(s, word).has_value(); });
  }
  void ChooseEach(const std::string& list, const std::string& field,
                  const std::vector<std::string>& entries) {
    for (const std::string& entry : entries) {
      Choose(list, entry);
      Look(entry, [&](const Json& s) { return s[field] == entry; });
    }
  }
  void ChooseOption(const std::string& list, const std::string& entry) {
    Choose(list, entry);
    Look(entry, [&](const Json& s) { return Option(s, "--" + list) == entry; });
  }
  /// A part of the panel, closed and opened again; `inside` is one of its controls.
  void Fold(const std::string& header, const std::string& inside) {
    ClickUntil(header, [&](const Json& s) { return !Has(s, inside); });
    ClickUntil(header, [&](const Json& s) { return Has(s, inside); });
  }
  void File(const std::string& control, const std::string& file) {
    Click(control);
    Look(file, [&](const Json&) { return fs::exists(In(file)); });
  }

  /// Every row, and that no control of the panel is without one.
  void Try(const std::vector<Row>& rows);
  std::vector<Row> InspectRows();
  std::vector<Row> WhereRows();
  std::vector<Row> RenderRows();
  std::vector<Row> PathRows();

  std::set<std::string> seen_;
};

std::vector<Controls::Row> Controls::InspectRows() {
  const auto twice = [this](const std::string& box) {
    return Row{box, [=, this] {
                 ClickUntilItIs(box, box, true);
                 ClickUntilItIs(box, box, false);
               }};
  };
  const auto left_out = [this](const std::string& view) {
    return Row{"view " + view, [=, this] {
                 ClickUntilItIs("view " + view, "hidden", Json::array({view}));
                 ClickUntilItIs("view " + view, "hidden", Json::array());
               }};
  };
  return {
      {"shown",
       [this] {
         ChooseEach("shown", "shown",
                    {"depth", "sigma", "weights", "view count", "coverage", "wireframe", "colour"});
       }},
      {"Inspect", [this] { Fold("Inspect", "cameras"); }},
      twice("cameras"),
      twice("magnifier"),
      {"compare with",
       [this] {
         ChooseEach("compare with", "compared",
                    {"other primitive", "other method", "nothing", "nearest photo"});
       }},
      {"border",
       [this] {
         WaitUntilStill();
         const ImageRgb8 before = Screen();
         Click("border", 0.95);
         ExpectScreenChanges(before, 500, "the border between image and photo");
         Choose("compare with", "nothing");
       }},
      {"views to draw from",
       [this] { ClickUntil("views to draw from", [](const Json& s) { return Has(s, "all"); }); }},
      left_out("0000.jpg"),
      left_out("0001.jpg"),
      left_out("0002.jpg"),
      left_out("0003.jpg"),
      {"all",
       [this] {
         ClickUntilItIs("view 0003.jpg", "hidden", Json::array({"0003.jpg"}));
         ClickUntilItIs("all", "hidden", Json::array());
         ClickUntil("views to draw from", [](const Json& s) { return !Has(s, "all"); });
       }},
  };
}

std::vector<Controls::Row> Controls::WhereRows() {
  return {
      {"Where", [this] { Fold("Where", "nearest"); }},
      {"next", [this] { ClickUntilItIs("next", "at_view", "0003.jpg"); }},
      {"previous", [this] { ClickUntilItIs("previous", "at_view", "0002.jpg"); }},
      {"view all", [this] { ClickUntilItIs("view all", "at_view", ""); }},
      {"home", [this] { ClickUntil("home", [](const Json& s) { return s["at_view"] != ""; }); }},
      {"nearest",
       [this] { ClickUntil("nearest", [](const Json& s) { return s["at_view"] != ""; }); }},
      {"speed per s",
       [this] {
         Click("speed per s", 0.2);
         const Json slow = Look();
         Click("speed per s", 0.8);
         Look("a higher speed", [&](const Json& s) {
           return s["fly_speed"].get<double>() > 10 * slow["fly_speed"].get<double>();
         });
       }},
      {"Time", [this] { Fold("Time", "time step"); }},
      {"time step", [this] { ClickUntilItIs("time step", "time_step", 1); }},
      {"later", [this] { ClickUntilItIs("later", "time_step", 2); }},
      {"earlier", [this] { ClickUntilItIs("earlier", "time_step", 1); }},
      {"play", [this] { ExpectPlays([this] { Click("play"); }); }},
      {"loop",
       [this] {
         ClickUntilItIs("loop", "loops_time", false);
         ClickUntilItIs("loop", "loops_time", true);
       }},
      {"speed",
       [this] {
         Click("speed", 0.2);
         Look("a lower speed", [](const Json& s) { return s["time_speed"].get<double>() < 1; });
         Click("speed", 0.8);
         Look("a higher speed", [](const Json& s) { return s["time_speed"].get<double>() > 1; });
       }},
  };
}

std::vector<Controls::Row> Controls::RenderRows() {
  const auto slider = [this](const std::string& name, const std::string& word) {
    return Row{name, [=, this] { Slide(name, word); }};
  };
  const auto box = [this](const std::string& name, const std::string& word) {
    return Row{name, [=, this] { Tick(name, word); }};
  };
  // Sliders that are there for one kind of weight alone.
  const auto of_weight = [this](const std::string& blend, const std::string& name) {
    return Row{name, [=, this] {
                 ChooseOption("blend", blend);
                 Slide(name, "--" + name);
               }};
  };
  return {
      {"Render options", [this] { Fold("Render options", "method"); }},
      {"method",
       [this] {
         ChooseOption("method", "two-pass");
         Choose("method", "deferred");
         Look("deferred", [](const Json& s) { return !Option(s, "--method"); });
       }},
      {"primitive",
       [this] {
         ChooseOption("primitive", "splat");
         EXPECT_EQ(Option(Look(), "--method"), "two-pass") << "what has splats";
       }},
      slider("point-size", "--point-size"),
      slider("views", "--views"),
      slider("resolution", "--resolution"),
      {"blend", [this] { ChooseOption("blend", "angle"); }},
      of_weight("cosine", "exponent"),
      of_weight("exponential", "falloff"),
      of_weight("k-nearest", "blend-k"),
      slider("max-angle", "--max-angle"),
      slider("delta (px)", "--delta"),
      slider("depth-break (px)", "--depth-break"),
      slider("mesh-tolerance (px)", "--mesh-tolerance"),
      {"absolute-delta on", [this] { ClickUntilOption("absolute-delta on", "--absolute-delta"); }},
      slider("absolute-delta", "--absolute-delta"),
      {"absolute-depth-break on",
       [this] { ClickUntilOption("absolute-depth-break on", "--absolute-depth-break"); }},
      slider("absolute-depth-break", "--absolute-depth-break"),
      {"defaults",
       [this] {
         ClickUntil("defaults", [](const Json& s) { return s["render_options"].empty(); });
       }},
      box("blend linear light", "--blend-linear"),
      box("fill holes", "--fill-holes=false"),
      box("smooth edges", "--smooth-edges=false"),
  };
}

std::vector<Controls::Row> Controls::PathRows() {
  return {
      {"Path", [this] { Fold("Path", "fly"); }},
      {"add camera",
       [this] {
         Click("add camera");
         Look("a camera", [](const Json& s) { return s["path_keys"] == 1; });
       }},
      {"frames per camera",
       [this] {
         const Json before = Look();
         Click("frames per camera", 0.9);
         Look("more frames", [&](const Json& s) {
           return s["frames_per_key"].get<int>() > before["frames_per_key"].get<int>();
         });
       }},
      {"load...",
       [this] {
         ClickUntilItIs("load...", "asks_for_path", true);
         TypePath(WritePath("two-path-009.json", 2));
         Look("a path", [](const Json& s) { return s["path_keys"] == 2; });
       }},
      {"fly",
       [this] {
         ClickUntilItIs("view all", "at_view", "");
         ClickUntilItIs("fly", "at_view", "0001.jpg");
       }},
      {"record",
       [this] {
         Click("record");
         Look("a video", [&](const Json& s) {
           return !s["recording"].get<bool>() && fs::exists(In("moving-video-001.mp4"));
         });
       }},
      {"Keep", [this] { Fold("Keep", "save image"); }},
      {"copy command line",
       [this] {
         File("copy command line", "moving-camera-001.json");
         Look("the command", [](const Json& s) {
           return s["message"].get<std::string>().starts_with("dtr render ");
         });
       }},
      {"save image", [this] { File("save image", "moving-image-001.png"); }},
      {"save window", [this] { File("save window", "moving-window-001.png"); }},
  };
}

void Controls::Try(const std::vector<Row>& rows) {
  Open(400, 1400);
  if (IsSkipped()) return;
  for (const Row& row : rows) {
    SCOPED_TRACE(row.control);
    row.test();
    if (HasFailure()) return;  // the next would only fail for that
    EXPECT_TRUE(seen_.contains(row.control)) << "a test without a control";
  }
  std::set<std::string> tested;
  for (const std::vector<Row>& part : {InspectRows(), WhereRows(), RenderRows(), PathRows()}) {
    for (const Row& row : part) tested.insert(row.control);
  }
  for (const std::string& control : seen_) {
    EXPECT_TRUE(tested.contains(control)) << control << ": a control without a test";
  }
}

TEST_F(Controls, OfInspectionDoWhatTheySay) { Try(InspectRows()); }
TEST_F(Controls, OfPlaceAndTimeDoWhatTheySay) { Try(WhereRows()); }
TEST_F(Controls, OfRenderOptionsDoWhatTheySay) { Try(RenderRows()); }
TEST_F(Controls, OfPathsAndFilesDoWhatTheySay) { Try(PathRows()); }

}  // namespace
}  // namespace dtr::testing
