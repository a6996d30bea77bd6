// tests/viewer/moving_window.h -- `dtr view` of a dynamic set on a display of its own.
#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <memory>

#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "tests/support/moving_sphere_set.h"
#include "tests/support/virtual_display.h"
#include "tests/support/x_screen.h"
#include "tests/viewer/viewer_program.h"

namespace dtr::testing {

/// Pixels that differ by more than a level or two.
inline int Differing(const ImageRgb8& a, const ImageRgb8& b) {
  int count = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) {
      int largest = 0;
      for (int c = 0; c < 3; ++c) largest = std::max(largest, std::abs(a(x, y, c) - b(x, y, c)));
      count += largest > 2;
    }
  }
  return count;
}

/// Three time steps of a rolling ball, in a window at the screen's corner.
class MovingWindow : public MovingSphereSet {
 protected:
  using Json = nlohmann::json;
  static void SetUpTestSuite() { Make({"0", "0.5", "1"}); }

  /// Skips where no window can be had; else opens one of this size, pixels.
  void Open(int width_px, int height_px, const std::vector<std::string>& further = {},
            const std::string& set = Set()) {
    display_ = std::make_unique<VirtualDisplay>("1280x1800x24");
    if (!display_->up()) GTEST_SKIP() << "no display: Xvfb is missing or did not come up";
    for (const char* program : {"xdotool", "ffmpeg"}) {
      if (FindProgram(program).empty()) GTEST_SKIP() << program << " is missing";
    }
    width_px_ = width_px, height_px_ = height_px;
    std::vector<std::string> words{"--size",
                                   std::to_string(width_px) + "x" + std::to_string(height_px)};
    words.insert(words.end(), further.begin(), further.end());
    viewer_ = std::make_unique<ViewerProgram>(set, folder_.path(), words);
    Now();
  }

  Json Wait(const std::string& what, const std::function<bool(const Json&)>& holds) {
    return viewer_->WaitFor(what, holds);
  }
  Json Now() {
    return Wait("a whole image", [](const Json&) { return true; });
  }
  static void Do(const std::vector<std::string>& words) { ViewerProgram::Do(words); }
  static void Press(const std::string& key) { Do({"key", key}); }
  ImageRgb8 Screen() const { return ReadScreen(width_px_, height_px_); }

  /// Once at least so many pixels of the window differ from `before`.
  void ExpectScreenChanges(const ImageRgb8& before, int pixels, const std::string& what) const {
    int differing = 0;
    for (int i = 0; i < 600; ++i) {
      differing = Differing(before, Screen());
      if (differing >= pixels) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    ADD_FAILURE() << what << ": expected " << pixels << " pixels to change, found " << differing;
  }
  /// Until nothing has changed on the screen for a second.
  void WaitUntilStill() const {
    ImageRgb8 last = Screen();
    for (int same = 0, i = 0; same < 10 && i < 600; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      ImageRgb8 now = Screen();
      same = Differing(now, last) == 0 ? same + 1 : 0;
      last = std::move(now);
    }
  }

  /// Does something, waits until it shows in the state, and expects the window to look another.
  Json After(const std::vector<std::string>& words, const std::string& what,
             const std::function<bool(const Json&)>& holds, int pixels = 50) {
    const ImageRgb8 before = Screen();
    Do(words);
    const Json state = Wait(what, holds);
    ExpectScreenChanges(before, pixels, what);
    return state;
  }
  /// The same with one of the state's fields.
  Json AfterItIs(const std::vector<std::string>& words, const std::string& field,
                 const Json& value) {
    return After(words, field + " is " + value.dump(),
                 [&](const Json& state) { return state[field] == value; });
  }

  static Eigen::Vector3d Center(const Json& state) {
    const Json& c = state["center_in_world"];
    return Eigen::Vector3d(c[0].get<double>(), c[1].get<double>(), c[2].get<double>());
  }
  static Eigen::Quaterniond Rotation(const Json& state) {
    const Json& q = state["cam_from_world_wxyz"];
    return Eigen::Quaterniond(q[0].get<double>(), q[1].get<double>(), q[2].get<double>(),
                              q[3].get<double>());
  }
  /// How far the camera went, in its own frame: x right, y down, z forward.
  static Eigen::Vector3d WayInCam(const Json& before, const Json& after) {
    return Rotation(before) * (Center(after) - Center(before));
  }
  static double Turned(const Json& before, const Json& after) {
    return Rotation(before).angularDistance(Rotation(after));
  }
  static std::function<bool(const Json&)> MovedFrom(const Json& before) {
    return [before](const Json& now) { return WayInCam(before, now).norm() > 1e-4; };
  }
  static std::function<bool(const Json&)> TurnedFrom(const Json& before) {
    return [before](const Json& now) { return Turned(before, now) > 1e-4; };
  }

  /// Plays by whatever `press` does and stops again, until another time step is shown.
  void ExpectPlays(const std::function<void()>& press) {
    const Json start = Now();
    for (int i = 0; i < 20; ++i) {
      press();
      std::this_thread::sleep_for(std::chrono::milliseconds(700));
      press();
      WaitUntilStill();
      if (Now()["time_step"] != start["time_step"]) return;
    }
    ADD_FAILURE() << "playing never came to another time step";
  }

  /// Types a file's name into the window that asks for a path.
  static void TypePath(const std::string& file) {
    Do({"sleep", "0.5", "type", "--delay", "20", file});
    Press("Return");
  }
  /// A path of the first input cameras of the set, as many as asked for.
  std::string WritePath(const std::string& name, size_t cameras) const {
    const Json all = Json::parse(Text(At("t0/cameras.json")));
    Json some = all;
    some["views"] = Json::array();
    for (size_t i = 0; i < cameras; ++i) some["views"].push_back(all["views"][i]);
    WriteFileAtomically(In(name), some.dump());
    return In(name);
  }

  std::unique_ptr<VirtualDisplay> display_;
  std::unique_ptr<ViewerProgram> viewer_;
  int width_px_ = 0, height_px_ = 0;
};

}  // namespace dtr::testing
