// tests/simd/many_views.h -- a set of more views than a renderer's memory holds in its tests.
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "tests/cpu/render_testing.h"

namespace dtr::testing {

inline constexpr int kViews = 12;

/// Views along a line before a wall with a square on it; every fourth has another size.
inline DtrSet ManyViews() {
  std::vector<View> views;
  for (int i = 0; i < kViews; ++i) {
    Shot shot = ShotFrom("v" + std::string(1, static_cast<char>('a' + i)),
                         {0.4 * (i - kViews / 2), 0, 0}, {0, 0, 10});
    if (i % 4 == 3) shot.camera = PinholeCamera(80, 50, 75, 75, 40, 25);
    views.push_back(Photograph(SquareAndPlane(), shot));
  }
  return SetOf(std::move(views));
}

inline Shot CameraAt(double x) { return ShotFrom("n", {x, 0.1, 0.2}, {0, 0, 10}); }
inline constexpr double kWalk[] = {-2.2, -1.1, 0.1, 1.3, 2.1, 0.3, -1.9, 2.2};

inline RenderOptions Options(RenderMethod method, Primitive primitive = Primitive::kMesh) {
  RenderOptions options = OptionsOf(method);
  options.primitive = primitive;
  options.views = 4;
  return options;
}

}  // namespace dtr::testing
