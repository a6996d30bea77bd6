// peer_set SET.dtr OUT.dtr ROWS: the set as the renderers of MPEG and OpenDIBR were given it, so
// that times can be compared: the lowest ROWS rows are cut off, and every hole of the depth maps
// takes the nearest measured depth of its map (the first by rows of equally near ones), for those
// renderers know no holes.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/io/set_io.h"
#include "dtr/render/geometry.h"

namespace {

using dtr::View;

template <typename T>
dtr::Grid<T> WithoutLowestRows(const dtr::Grid<T>& grid, int rows) {
  dtr::Grid<T> cut(grid.width(), grid.height() - rows, grid.channels());
  std::copy_n(grid.data().begin(), cut.data().size(), cut.data().begin());
  return cut;
}

/// Exact nearest neighbours by squared distance: per column first, then along the rows
/// (Felzenszwalb & Huttenlocher's separation; the second step is the plain quadratic one).
void FillWithNearest(dtr::Grid<float>& depth) {
  const int width = depth.width(), height = depth.height(), none = width + height;
  dtr::Grid<int> source(width, height, 1, -1);  // row of the nearest value in the column
  for (int x = 0; x < width; ++x) {
    for (const int step : {1, -1}) {
      int last = -1;
      for (int y = step > 0 ? 0 : height - 1; y >= 0 && y < height; y += step) {
        if (depth(x, y) > 0) last = y;
        const int before = source(x, y) < 0 ? none : std::abs(source(x, y) - y);
        if (last >= 0 && std::abs(last - y) < before) source(x, y) = last;
      }
    }
  }
  const dtr::Grid<float> measured = depth;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (measured(x, y) > 0) continue;
      long long best = std::numeric_limits<long long>::max();
      for (int other = 0; other < width; ++other) {
        const long long dx = other - x, dy = source(other, y) - y;
        if (source(other, y) < 0 || dx * dx >= best || dx * dx + dy * dy >= best) continue;
        best = dx * dx + dy * dy;
        depth(x, y) = measured(other, source(other, y));
      }
    }
  }
}

void Cut(View& view, int rows) {
  if (view.depth_scale != 1) throw dtr::Error(view.name + ": expected depth at the image's size");
  const dtr::PinholeCamera c = view.camera;
  view.camera = dtr::PinholeCamera(c.width_px(), c.height_px() - rows, c.fx_px(), c.fy_px(),
                                   c.cx_px(), c.cy_px());
  view.image = WithoutLowestRows(view.image, rows);
  if (!view.mask.empty()) view.mask = WithoutLowestRows(view.mask, rows);
  dtr::Grid<float> depth = WithoutLowestRows(view.depth.grid(), rows);
  FillWithNearest(depth);
  view.depth = dtr::DepthImage(depth.width(), depth.height());
  view.depth.grid() = depth;
  view.inverse_depth_sigma.reset();
  view.image_file.reset(), view.mask_file.reset(), view.depth_file.reset();
  view.sigma_file.reset();
}

int Run(char** arguments) {
  dtr::DtrSet set = dtr::io::LoadSet(arguments[1]);
  const int rows = std::atoi(arguments[3]);
  dtr::io::SetWriter writer(arguments[2], R"({"tool":"peer_set"})", true);
  for (View& view : set.frames.at(0).views) {
    Cut(view, rows);
    writer.WriteView(view, set.unit);
  }
  set.sparse_file.reset();
  dtr::FinishGeometry(set);
  writer.Finish(set);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  try {
    return Run(argv);
  } catch (const dtr::Error& error) {
    std::fprintf(stderr, "peer_set: %s\n", error.what());
    return 1;
  }
}
