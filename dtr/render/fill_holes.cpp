#include "dtr/render/fill_holes.h"

#include "dtr/base/parallel_for.h"
#include "dtr/render/colour.h"
#include "dtr/render/push_pull.h"

namespace dtr {
namespace {

Mask HolesOf(const Grid<float>& depth) {
  Mask holes(depth.width(), depth.height());
  for (size_t p = 0; p < holes.data().size(); ++p) holes.data()[p] = depth.data()[p] > 0 ? 0 : 255;
  return holes;
}

}  // namespace

Grid<float> SeenDepth(const RenderResult& result) {
  Grid<float> seen = result.depth.grid();
  for (size_t p = 0; p < seen.data().size(); ++p) {
    if (result.coverage.data()[p] == 0) seen.data()[p] = 0;
  }
  return seen;
}

Grid<float> FillHoles(RenderResult& result) {
  using Cell = PushPull::Cell;
  Grid<float> depth = SeenDepth(result);
  const std::array<double, 256>& linear = LinearFromSrgb8();
  const PushPull surroundings(HolePyramid(HolesOf(depth)), [&](int x, int y) {
    const double z = depth(x, y);
    if (!(z > 0)) return Cell{};
    const std::uint8_t* rgb = &result.image(x, y);
    return Cell{1, {linear[rgb[0]], linear[rgb[1]], linear[rgb[2]], 1 / z}};
  });
  ParallelFor(0, depth.height(), [&](int y) {
    for (int x = 0; x < depth.width(); ++x) {
      if (result.coverage(x, y) != 0) continue;
      const Cell cell = surroundings.At(x, y);
      if (!(cell.weight > 0)) continue;
      for (int c = 0; c < 3; ++c) {
        result.image(x, y, c) = Srgb8FromLinear(cell.values[static_cast<size_t>(c)]);
      }
      depth(x, y) = static_cast<float>(1 / cell.values[3]);
    }
  });
  return depth;
}

}  // namespace dtr
