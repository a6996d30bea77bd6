// tests/viewer/viewer_window.h -- tests of `dtr view` in a window, of a small set.
#pragma once
#include <cmath>

#include "tests/support/small_courtyard_set.h"
#include "tests/support/virtual_display.h"
#include "tests/viewer/viewer_program.h"

namespace dtr::testing {

class ViewerWindow : public SmallCourtyardSet {
 public:
  using Json = nlohmann::json;

 protected:
  void NeedDisplay() {
    if (!display_.up()) GTEST_SKIP() << "no display: Xvfb is missing or did not come up";
    if (FindProgram("xdotool").empty()) GTEST_SKIP() << "xdotool is missing";
  }
  static double Moved(const Json& a, const Json& b) {
    double sum = 0;
    for (size_t i = 0; i < 3; ++i) {
      const double d =
          a["center_in_world"][i].get<double>() - b["center_in_world"][i].get<double>();
      sum += d * d;
    }
    return std::sqrt(sum);
  }
  static std::function<bool(const Json&)> MovedFrom(const Json& before) {
    return [before](const Json& now) { return Moved(before, now) > 1e-3; };
  }
  static bool Anything(const Json&) { return true; }

  VirtualDisplay display_;
};

}  // namespace dtr::testing
