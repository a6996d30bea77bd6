// 2000 random inputs to a real window of a moving set: no crash, no hang; with the preset asan no
// leak either.
#include <fstream>

#include "dtr/base/random.h"
#include "tests/support/moving_sphere_set.h"
#include "tests/support/virtual_display.h"
#include "tests/viewer/viewer_program.h"

namespace dtr::testing {
namespace {

constexpr int kInputs = 2000;

/// One line of xdotool. Everything the help lists but quitting, and what it does not list.
std::string RandomInput(Random& random) {
  constexpr const char* kKeys[] = {
      "w",    "a", "s",  "d",      "e",      "q",     "Right",  "Left",     "c",      "v",
      "Home", "t", "n",  "b",      "o",      "r",     "p",      "F12",      "Down",   "Up",
      "f",    "g", "x",  "h",      "m",      "l",     "k",      "Tab",      "F1",     "z",
      "1",    "2", "F5", "Escape", "Escape", "space", "Return", "question", "shift+w"};
  switch (random.Index(6)) {
    case 0:
    case 1:
      return "mousemove " + std::to_string(random.Index(700)) + " " +
             std::to_string(random.Index(500));
    case 2:
      return std::string(random.Index(2) == 0 ? "mousedown " : "mouseup ") +
             std::to_string(1 + random.Index(3));
    case 3:
      return "click " + std::to_string(1 + random.Index(5));
    default:
      return std::string("key ") + kKeys[random.Index(static_cast<int>(std::size(kKeys)))];
  }
}

using RandomInputTest = MovingSphereSet;

TEST_F(RandomInputTest, LeavesAViewerThatWorks) {
  const VirtualDisplay display;
  if (!display.up()) GTEST_SKIP() << "no display: Xvfb is missing or did not come up";
  if (FindProgram("xdotool").empty()) GTEST_SKIP() << "xdotool is missing";
  ViewerProgram viewer(Set(), folder_.path(), {"--size", "600x400"});
  viewer.WaitFor("the first picture", [](const auto&) { return true; });
  Random random(2026);
  const std::string script = In("inputs");
  {
    std::ofstream out(script);
    for (int i = 0; i < kInputs; ++i) out << RandomInput(random) << "\n";
    for (int button = 1; button <= 3; ++button) out << "mouseup " << button << "\n";
    out << "mousemove 590 390\n";
  }
  ViewerProgram::Do({script});
  ViewerProgram::Do({"key", "ctrl+q"});
  EXPECT_EQ(viewer.WaitForEnd(), 0);
  EXPECT_TRUE(std::filesystem::exists(In("moving-picture-001.png"))) << "inputs did arrive";
}

}  // namespace
}  // namespace dtr::testing
