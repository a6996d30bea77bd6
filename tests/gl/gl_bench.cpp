// gl_bench SET.dtr [K] [R] [WIDTH]: from the middle of the set's own path, the time of each pass of
// a frame and of whole frames, by two passes and by the deferred method. By the GPU's clock where
// there is one (then with frames in a row by the wall's, too), else CPU time of all threads.
#include <epoxy/gl.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <vector>

#include "dtr/eval/timed_renderer.h"
#include "dtr/gl/context.h"
#include "dtr/gl/deferred.h"
#include "dtr/gl/driver.h"
#include "dtr/gl/frame_timer.h"
#include "dtr/gl/gpu_views.h"
#include "dtr/gl/renderer.h"
#include "dtr/gl/resolve.h"
#include "dtr/gl/two_pass.h"
#include "dtr/gl/view_mesh.h"
#include "dtr/io/set_io.h"
#include "dtr/render/camera_path.h"
#include "dtr/render/frame.h"
#include "dtr/render/valid_views.h"

namespace {

constexpr int kFrames = 5, kGpuFrames = 101;
constexpr double kWarmUpMs = 300;  // an idle GPU's clocks are slow

using Draw = std::function<void()>;

/// Least CPU time of some frames, or the GPU's median.
double Milliseconds(const Draw& draw) {
  dtr::gl::FrameTimer timer;
  std::vector<double> times;
  if (!timer.has_gpu_clock()) {
    for (int i = 0; i <= kFrames; ++i) {
      const dtr::eval::StopWatch watch;
      draw();
      glFinish();
      if (i > 0) times.push_back(watch.Elapsed().cpu_ms);  // the first warms up
    }
    return *std::min_element(times.begin(), times.end());
  }
  for (const dtr::eval::StopWatch watch; watch.Elapsed().wall_ms < kWarmUpMs;) {
    draw();
    glFinish();
  }
  for (int i = 0; i < kGpuFrames; ++i) times.push_back(*timer.GpuMilliseconds(draw));
  return dtr::eval::TimesOf(times).median_ms;
}

/// Wall clock of a frame of many that are queued one behind the other, as an application does.
double InARowMilliseconds(const Draw& draw) {
  glFinish();
  const dtr::eval::StopWatch watch;
  for (int i = 0; i < kGpuFrames; ++i) draw();
  glFinish();
  return watch.Elapsed().wall_ms / kGpuFrames;
}

struct Passes {
  double depth_ms = 0;    ///< the views' surfaces
  double resolve_ms = 0;  ///< the pass over the pixels
};

/// The passes of the frame's method, each alone.
Passes TimePasses(dtr::RenderFrame frame, const dtr::ViewSelection& selection) {
  using namespace dtr::gl;
  const StateGuard guard;
  GpuViews views(size_t{16} << 30, [](const std::string&) {});
  ProgramCache programs("");
  Targets targets;
  CoarseDepth coarse;
  Resolver resolver;
  views.Prepare(frame, dtr::NearestFirst(frame.scene, selection));
  dtr::SetCutFactors(selection, frame.views.size(), frame);
  const dtr::Band band{0, frame.novel.height_px()};
  targets.Fit(frame.novel.width_px(), band.count,
              frame.deferred() ? 1 : static_cast<int>(frame.views.size()));
  resolver.SetViews(frame, views.store());
  const Draw depth = [&] {
    if (frame.deferred()) {
      coarse.Draw(frame, band, views.meshes(), programs, targets);
    } else {
      DrawViewLayers(frame, band, views.store(), programs, targets, HasClipControl());
    }
  };
  const Draw resolve = [&] {
    resolver.Draw(frame, band, views.store(), programs, targets, coarse.buffer());
  };
  Passes passes;
  passes.depth_ms = Milliseconds(depth);
  passes.resolve_ms = Milliseconds(resolve);
  return passes;
}

struct Bench {
  const dtr::RenderScene& scene;
  const dtr::NovelCamera& novel;
  dtr::RenderOptions options;

  dtr::RenderFrame Frame(const dtr::ViewSelection& selection) const {
    return dtr::MakeFrame(scene, novel.camera, novel.cam_from_world, options, selection);
  }

  /// One line; returns the time of a whole frame.
  double Print(const char* name, dtr::RenderMethod method, double triangles) {
    options.method = method;
    const dtr::ViewSelection selection = dtr::SelectViews(scene, novel.cam_from_world, options);
    const Passes passes = TimePasses(Frame(selection), selection);
    dtr::gl::Renderer renderer;
    const Draw draw = [&] { renderer.Draw(scene, novel.camera, novel.cam_from_world, options); };
    const double whole = Milliseconds(draw);
    std::printf("%-10s surfaces %8.3f  pixels %8.3f  whole frame %8.3f ms", name, passes.depth_ms,
                passes.resolve_ms, whole);
    if (triangles > 0) std::printf(", %.2f ns a triangle", 1e6 * passes.depth_ms / triangles);
    if (!dtr::gl::DrawsOnProcessor()) {
      std::printf(", in a row %.3f ms by the wall", InARowMilliseconds(draw));
    }
    std::printf("\n");
    return whole;
  }
};

dtr::PinholeCamera OfWidth(const dtr::PinholeCamera& camera, int width_px) {
  const double factor = static_cast<double>(width_px) / camera.width_px();
  return {width_px,
          static_cast<int>(camera.height_px() * factor + 0.5),
          camera.fx_px() * factor,
          camera.fy_px() * factor,
          camera.cx_px() * factor,
          camera.cy_px() * factor};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "gl_bench SET.dtr [K] [R] [WIDTH]\n");
    return 2;
  }
  const dtr::DtrSet set = dtr::io::LoadSet(argv[1], {.completed = true});
  const dtr::RenderScene scene = dtr::MakeRenderScene(set);
  dtr::NovelCamera novel = dtr::FlyThrough(set, 9)[4];
  dtr::RenderOptions options;
  if (argc > 2) options.views = std::atoi(argv[2]);
  if (argc > 3) options.resolution = std::atoi(argv[3]);
  if (argc > 4) novel.camera = OfWidth(novel.camera, std::atoi(argv[4]));
  const dtr::gl::EglContext context;
  double triangles = 0;
  const dtr::ViewSelection selection = dtr::SelectViews(scene, novel.cam_from_world, options);
  for (const int index : selection.views) {
    const dtr::View& view = *scene.views[static_cast<size_t>(index)];
    triangles += static_cast<double>(dtr::gl::MakeViewMesh(view, options).indices.size() / 3);
  }
  std::printf("%s; %dx%d, R %d: %.2f M triangles of %zu views; %s\n", context.Description().c_str(),
              novel.camera.width_px(), novel.camera.height_px(), options.resolution,
              1e-6 * triangles, selection.views.size(),
              dtr::gl::DrawsOnProcessor() ? "CPU time" : "GPU time");
  Bench bench{scene, novel, options};
  const double two_pass = bench.Print("two-pass", dtr::RenderMethod::kTwoPass, triangles);
  const double deferred = bench.Print("deferred", dtr::RenderMethod::kDeferred, 0);
  std::printf("deferred is %.1f times as fast\n", two_pass / deferred);
  return 0;
}
