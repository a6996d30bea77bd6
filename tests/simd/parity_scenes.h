// tests/simd/parity_scenes.h -- small sets that fast renderers are compared with the reference on.
#pragma once
#include <string>
#include <vector>

#include "dtr/base/random.h"
#include "dtr/render/scene.h"
#include "tests/cpu/render_testing.h"

namespace dtr::testing {

struct NamedScene {
  std::string name;
  DtrSet set;
  Shot novel;
};

/// A plane that leans, spheres before it, a step, a map with holes and masks and gains, thin rods,
/// and cameras that look outwards from the middle of a room (the per-pixel rule).
inline std::vector<NamedScene> ParityScenes() {
  std::vector<NamedScene> scenes;
  const Shot ahead = ShotFrom("n", {0.17, 0.11, 0.3}, {0.2, -0.1, 10});
  scenes.push_back(
      {"leaning plane", FromAround(Plane({0.4, 0.1, 0.9}, 8), 4, 0.8, {0, 0, 9}), ahead});
  scenes.push_back({"spheres",
                    FromAround(Union(Union(Sphere({-1, 0.3, 6}, 1.2), Sphere({1.6, -0.4, 7}, 1)),
                                     Plane({0, 0, 1}, 11)),
                               6, 0.7, {0, 0, 9}),
                    ahead});
  scenes.push_back({"square and plane", SquareBeforePlane(), ahead});
  DtrSet damaged =
      FromAround(Union(Square(0.3, 0.2, 5, 1), Plane({0.2, 0, 1}, 9)), 5, 0.6, {0, 0, 9});
  Random random(7);
  for (View& view : damaged.frames[0].views) {
    view.mask = Mask(view.image.width(), view.image.height(), 1, 255);
    for (int k = 0; k < 12; ++k) {
      const int x = random.Index(86), y = random.Index(64);
      for (int j = 0; j < 6; ++j) {
        for (int i = 0; i < 6; ++i) {
          if (k % 2 == 0)
            view.depth(x + i, y + j) = 0;
          else
            view.mask(x + i, y + j) = 0;
        }
      }
    }
  }
  FinishGeometry(damaged);
  scenes.push_back({"holes and masks", std::move(damaged), ahead});
  Surface rods = Plane({0, 0, 1}, 10);
  for (int k = -2; k <= 2; ++k) rods = Union(rods, Square(0.9 * k, 0.3 * k, 5 + 0.2 * k, 0.09));
  scenes.push_back({"small squares", FromAround(rods, 4, 0.5, {0, 0, 9}, 2), ahead});
  const Surface room = [](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    double nearest = kNoHit;
    for (int axis = 0; axis < 3; ++axis) {
      if (d[axis] == 0) continue;
      nearest = std::min(nearest, ((d[axis] > 0 ? 5.0 : -5.0) - o[axis]) / d[axis]);
    }
    return nearest;
  };
  std::vector<View> outwards;
  for (int i = 0; i < 10; ++i) {
    const double angle = 2 * 3.14159265358979323846 * i / 10;
    const Eigen::Vector3d centre(0.5 * std::cos(angle), 0.1 * i, 0.5 * std::sin(angle));
    outwards.push_back(
        Photograph(room, ShotFrom("r" + std::to_string(i), centre,
                                  centre + Eigen::Vector3d(std::cos(angle), 0, std::sin(angle)))));
  }
  scenes.push_back({"room from inside", SetOf(std::move(outwards)),
                    ShotFrom("n", {0.1, 0.2, 0.05}, {2, 0.3, 1})});
  // Photos of one world agree on its colours, whatever the weights: gains tell the views apart.
  for (NamedScene& scene : scenes) {
    double gain = 0.6;
    for (View& view : scene.set.frames[0].views) {
      view.gain = {gain, 1.3 - 0.5 * gain, 1.0};
      gain = gain > 1 ? 0.65 : gain + 0.17;
    }
  }
  return scenes;
}

}  // namespace dtr::testing
