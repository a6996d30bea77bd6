// own_place_report: does an input camera's own place show its photo? PSNR of the rendered image,
// holes filled and edges smoothed, against each source photo, drawn from all views;
// docs/accuracy/RENDERING.md has the figures.
//
//   own_place_report SET.dtr
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>

#include "dtr/eval/metrics.h"
#include "dtr/io/set_io.h"
#include "dtr/render/scene.h"
#include "dtr/simd/renderer.h"

namespace {

void Report(const char* set_file) {
  const dtr::DtrSet set = dtr::io::LoadSet(set_file, {.completed = true});
  const dtr::RenderScene scene = dtr::MakeRenderScene(set);
  dtr::RenderOptions options;
  options.fill_holes = options.smooth_edges = true;
  dtr::simd::Renderer renderer;
  double lowest = std::numeric_limits<double>::infinity(), sum = 0;
  for (const dtr::View* view : scene.views) {
    const dtr::RenderResult own =
        renderer.Render(scene, view->camera, view->cam_from_world, options);
    const double psnr_db = dtr::eval::Psnr(own.image, view->image, view->mask).value_or(NAN);
    std::printf("%-28s %6.2f dB\n", view->name.c_str(), psnr_db);
    lowest = std::min(lowest, psnr_db);
    sum += psnr_db;
  }
  std::printf("lowest %.2f, mean %.2f dB\n", lowest, sum / static_cast<double>(scene.views.size()));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "own_place_report SET.dtr\n");
    return 2;
  }
  try {
    Report(argv[1]);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
