// gl_bench SET.dtr [K] [R]: milliseconds per frame of a set's renderers from between its first two
// source cameras: median of several frames after a warm-up, wall clock and the process's CPU time
// (GL timer queries read almost nothing on llvmpipe), the two passes also as the least CPU time per
// triangle, with PSNR to the reference.
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "dtr/cpu/renderer.h"
#include "dtr/gl/context.h"
#include "dtr/gl/renderer.h"
#include "dtr/gl/two_pass.h"
#include "dtr/gl/view_mesh.h"
#include "dtr/io/set_io.h"
#include "dtr/render/camera_path.h"

namespace {

using dtr::RenderResult;
constexpr int kFrames = 5;

double CpuMilliseconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

double Psnr(const RenderResult& a, const RenderResult& b) {
  double sum = 0, count = 0;
  for (size_t p = 0; p < a.coverage.data().size(); ++p) {
    if (a.coverage.data()[p] == 0 || b.coverage.data()[p] == 0) continue;
    for (size_t c = 0; c < 3; ++c) {
      const double d = double(a.image.data()[3 * p + c]) - double(b.image.data()[3 * p + c]);
      sum += d * d, ++count;
    }
  }
  return sum > 0 ? 10 * std::log10(255 * 255 * count / sum) : 99;
}

RenderResult Measure(const char* name, int frames, const std::function<RenderResult()>& render,
                     double* cpu_ms) {
  RenderResult result = render();
  std::vector<double> wall, cpu;
  for (int i = 0; i < frames; ++i) {
    const double cpu_start = CpuMilliseconds();
    const auto start = std::chrono::steady_clock::now();
    result = render();
    const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - start;
    wall.push_back(ms.count());
    cpu.push_back(CpuMilliseconds() - cpu_start);
  }
  std::sort(wall.begin(), wall.end());
  std::sort(cpu.begin(), cpu.end());
  *cpu_ms = cpu.front();
  std::printf("%-22s wall %8.1f ms (%.1f ... %.1f), CPU %8.1f ms\n", name, wall[wall.size() / 2],
              wall.front(), wall.back(), cpu[cpu.size() / 2]);
  return result;
}

/// Least CPU time of drawing the views' triangles alone: SPEC 4.2, without the resolving pass.
double DrawingMilliseconds(const dtr::RenderScene& scene, const dtr::NovelCamera& novel,
                           const dtr::RenderOptions& options, const std::vector<int>& views) {
  dtr::gl::Frame frame{scene, novel.camera, options, false, {}, {}};
  for (const int index : views) {
    const dtr::View& view = *scene.views[static_cast<size_t>(index)];
    frame.views.push_back(&view);
    frame.placements.push_back(dtr::PlaceView(view, novel.cam_from_world));
  }
  const dtr::gl::StateGuard guard;
  dtr::gl::ViewStore store;
  dtr::gl::ProgramCache programs("");
  dtr::gl::Targets targets;
  store.Prepare(frame.views, options);
  const dtr::gl::Band band{0, novel.camera.height_px()};
  targets.Fit(novel.camera.width_px(), band.count, static_cast<int>(views.size()));
  double least = 0;
  for (int i = 0; i <= kFrames; ++i) {
    const double start = CpuMilliseconds();
    dtr::gl::DrawViewLayers(frame, band, store, programs, targets, dtr::gl::HasClipControl());
    glFinish();
    const double ms = CpuMilliseconds() - start;
    if (i == 1 || (i > 1 && ms < least)) least = ms;  // the first warms up
  }
  return least;
}

double TrianglesOf(const dtr::RenderScene& scene, const std::vector<int>& views,
                   const dtr::RenderOptions& options) {
  size_t indices = 0;
  for (const int index : views) {
    indices +=
        dtr::gl::MakeViewMesh(*scene.views[static_cast<size_t>(index)], options).indices.size();
  }
  return static_cast<double>(indices / 3);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  const dtr::DtrSet set = dtr::io::LoadSet(argv[1], {});
  const dtr::RenderScene scene = dtr::MakeRenderScene(set);
  const dtr::NovelCamera novel = dtr::FlyThrough(set, 9)[4];
  dtr::RenderOptions options;
  if (argc > 2) options.views = std::atoi(argv[2]);
  if (argc > 3) options.resolution = std::atoi(argv[3]);
  dtr::gl::EglContext context;
  dtr::gl::Renderer renderer;
  std::printf("%s; %dx%d, K %d, R %d\n", context.Description().c_str(), novel.camera.width_px(),
              novel.camera.height_px(), options.views, options.resolution);
  double cpu_ms = 0;
  const RenderResult reference = Measure(
      "reference (1 frame)", 1,
      [&] { return dtr::cpu::Render(scene, novel.camera, novel.cam_from_world, options); },
      &cpu_ms);
  const RenderResult two_pass = Measure(
      "OpenGL two-pass", kFrames,
      [&] { return renderer.Render(scene, novel.camera, novel.cam_from_world, options); }, &cpu_ms);
  const double triangles = TrianglesOf(scene, two_pass.views_used, options);
  const double drawing_ms = DrawingMilliseconds(scene, novel, options, two_pass.views_used);
  std::printf(
      "%-22s %.1f M triangles from %zu views: least CPU time %.1f ns each, drawing %.1f ns\n", "",
      1e-6 * triangles, two_pass.views_used.size(), 1e6 * cpu_ms / triangles,
      1e6 * drawing_ms / triangles);
  options.method = dtr::RenderMethod::kDeferred;
  const RenderResult deferred = Measure(
      "OpenGL deferred", kFrames,
      [&] { return renderer.Render(scene, novel.camera, novel.cam_from_world, options); }, &cpu_ms);
  std::printf("to the reference: two-pass %.2f dB, deferred %.2f dB; coverage %.4f, %.4f, %.4f\n",
              Psnr(reference, two_pass), Psnr(reference, deferred), reference.coverage_share,
              two_pass.coverage_share, deferred.coverage_share);
  return 0;
}
