// frame_report: what does a whole frame cost, and did a change of the code change one byte of it?
// CPU time of frames of a set's fly-through by the renderer without a GPU, holes filled and edges
// smooth, on one thread, and a hash of all results; two builds of it compare two commits.
//
//   frame_report SET.dtr [frames=12] [repeats=5]
#include <algorithm>
#include <cstdio>
#include <exception>
#include <span>
#include <string>
#include <vector>

#include "dtr/base/hash.h"
#include "dtr/base/machine.h"
#include "dtr/base/order_statistics.h"
#include "dtr/io/set_io.h"
#include "dtr/render/camera_path.h"
#include "dtr/render/scene.h"
#include "dtr/simd/renderer.h"

namespace {

template <typename T>
std::string HashOf(const std::vector<T>& values) {
  return dtr::Sha256(std::as_bytes(std::span(values)));
}

std::string HashOf(const dtr::RenderResult& result) {
  return HashOf(result.image.data()) + HashOf(result.depth.grid().data()) +
         HashOf(result.coverage.data()) + HashOf(result.view_count.data()) +
         HashOf(result.delta_border.data());
}

/// Prints the median over the path of each frame's least CPU time, in ms.
void Report(const char* set_file, int frames, int repeats) {
  const dtr::DtrSet set = dtr::io::LoadSet(set_file, {.completed = true});
  const dtr::RenderScene scene = dtr::MakeRenderScene(set);
  dtr::RenderOptions options;
  options.fill_holes = options.smooth_edges = true;
  dtr::simd::Renderer renderer;
  const std::vector<dtr::NovelCamera> path = dtr::FlyThrough(set, frames);
  std::vector<double> least_ms(path.size());
  std::string hashes;
  for (int repeat = 0; repeat <= repeats; ++repeat) {  // the first one prepares the views
    for (size_t i = 0; i < path.size(); ++i) {
      const double start_ms = dtr::ProcessCpuMilliseconds();
      const dtr::RenderResult result =
          renderer.Render(scene, path[i].camera, path[i].cam_from_world, options);
      const double ms = dtr::ProcessCpuMilliseconds() - start_ms;
      least_ms[i] = repeat <= 1 ? ms : std::min(least_ms[i], ms);
      if (repeat == 0) hashes += HashOf(result);
    }
  }
  const std::vector<char> all(hashes.begin(), hashes.end());
  std::printf("%s: %d frames, median of the least of %d: %.1f CPU ms, results %.16s\n", set_file,
              frames, repeats, dtr::UpperMedian(least_ms), HashOf(all).c_str());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 4) {
    std::fprintf(stderr, "frame_report SET.dtr [frames=12] [repeats=5]\n");
    return 2;
  }
  try {
    Report(argv[1], argc > 2 ? std::stoi(argv[2]) : 12, argc > 3 ? std::stoi(argv[3]) : 5);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
