// Random inputs to a real window of a dynamic set, several draws of them: no crash, no hang, and an
// end when it is asked for.
#include <fstream>

#include "dtr/base/random.h"
#include "tests/support/moving_sphere_set.h"
#include "tests/support/virtual_display.h"
#include "tests/viewer/viewer_program.h"

namespace dtr::testing {
namespace {

constexpr int kInputs = 2000, kInputsOfOthers = 600, kFirstSeed = 2026;

/// Keys that are held for a while, windows that change their size, words typed into whatever has
/// the focus: a line of xdotool.
std::string RandomlyHeldOrTyped(Random& random) {
  constexpr const char* kHeld[] = {"w", "a", "s", "d", "e", "q", "shift", "Right", "space"};
  constexpr const char* kTyped[] = {"two-path-001.json", "../x y", "1e9", "-3.5", "%s%n",
                                    "/proc/self/mem"};
  switch (random.Index(4)) {
    case 0:
    case 1:
      return std::string(random.Index(2) == 0 ? "keydown " : "keyup ") +
             kHeld[random.Index(static_cast<int>(std::size(kHeld)))];
    case 2:
      return std::string("type --delay 2 \"") +
             kTyped[random.Index(static_cast<int>(std::size(kTyped)))] + "\"";
    default:
      return "search --name \"dtr view\" windowsize " + std::to_string(1 + random.Index(800)) +
             " " + std::to_string(1 + random.Index(600));
  }
}

/// One line of xdotool. Everything the help lists but quitting, and what it does not list.
std::string RandomInput(Random& random) {
  constexpr const char* kKeys[] = {
      "w",    "a", "s",  "d",      "e",      "q",     "Right",  "Left",     "c",      "v",
      "Home", "t", "n",  "b",      "o",      "r",     "p",      "F12",      "Down",   "Up",
      "f",    "g", "x",  "h",      "m",      "l",     "k",      "Tab",      "F1",     "z",
      "1",    "2", "F5", "Escape", "Escape", "space", "Return", "question", "shift+w"};
  switch (random.Index(8)) {
    case 0:
    case 1:
      return "mousemove " + std::to_string(random.Index(700)) + " " +
             std::to_string(random.Index(500));
    case 2:
      return std::string(random.Index(2) == 0 ? "mousedown " : "mouseup ") +
             std::to_string(1 + random.Index(3));
    case 3:
      return "click " + std::to_string(1 + random.Index(5));
    case 4:
      return RandomlyHeldOrTyped(random);
    default:
      return std::string("key ") + kKeys[random.Index(static_cast<int>(std::size(kKeys)))];
  }
}

class RandomInputTest : public MovingSphereSet, public ::testing::WithParamInterface<int> {};

TEST_P(RandomInputTest, LeavesAViewerThatWorks) {
  const VirtualDisplay display;
  if (!display.up()) GTEST_SKIP() << "no display: Xvfb is missing or did not come up";
  if (FindProgram("xdotool").empty()) GTEST_SKIP() << "xdotool is missing";
  ViewerProgram viewer(Set(), folder_.path(), {"--size", "600x400"});
  viewer.WaitFor("the first image", [](const auto&) { return true; });
  Random random(static_cast<std::uint64_t>(GetParam()));
  const int inputs = GetParam() == kFirstSeed ? kInputs : kInputsOfOthers;
  const std::string script = In("inputs");
  {
    std::ofstream out(script);
    for (int i = 0; i < inputs; ++i) out << RandomInput(random) << "\n";
    for (int button = 1; button <= 3; ++button) out << "mouseup " << button << "\n";
    for (const char* key : {"w", "a", "s", "d", "e", "q", "shift", "Right", "space"}) {
      out << "keyup " << key << "\n";
    }
    out << "search --name \"dtr view\" windowsize 600 400\nmousemove 590 390\n";
  }
  ViewerProgram::Do({script});
  ViewerProgram::Do({"key", "ctrl+q"});
  EXPECT_EQ(viewer.WaitForEnd(), 0);
  EXPECT_TRUE(std::filesystem::exists(In("moving-image-001.png"))) << "inputs did arrive";
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomInputTest, ::testing::Values(kFirstSeed, 7, 31));

}  // namespace
}  // namespace dtr::testing
