// gl_bench SET.dtr [K] [R]: from the middle of the set's own path the least CPU time of laying down
// the views' full meshes (SPEC 4.2) and of whole frames: by two passes, by the deferred method as
// this machine draws it, and by the deferred method's shaders, as a GPU would be asked to.
#include <epoxy/gl.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <vector>

#include "dtr/eval/timed_renderer.h"
#include "dtr/gl/context.h"
#include "dtr/gl/driver.h"
#include "dtr/gl/renderer.h"
#include "dtr/gl/two_pass.h"
#include "dtr/gl/view_mesh.h"
#include "dtr/io/set_io.h"
#include "dtr/render/camera_path.h"
#include "dtr/render/valid_views.h"

namespace {

constexpr int kFrames = 5;

double LeastMilliseconds(const std::function<void()>& draw) {
  std::vector<double> times;
  for (int i = 0; i <= kFrames; ++i) {
    const dtr::eval::StopWatch watch;
    draw();
    glFinish();
    if (i > 0) times.push_back(watch.Elapsed().cpu_ms);  // the first warms up
  }
  return *std::min_element(times.begin(), times.end());
}

double DrawingMilliseconds(const dtr::RenderFrame& frame) {
  const dtr::gl::StateGuard guard;
  dtr::gl::ViewStore store;
  dtr::gl::ProgramCache programs("");
  dtr::gl::Targets targets;
  store.Prepare(frame.views, frame.options);
  const dtr::Band band{0, frame.novel.height_px()};
  targets.Fit(frame.novel.width_px(), band.count, static_cast<int>(frame.views.size()));
  return LeastMilliseconds([&] {
    dtr::gl::DrawViewLayers(frame, band, store, programs, targets, dtr::gl::HasClipControl());
  });
}

double FrameMilliseconds(const dtr::RenderScene& scene, const dtr::NovelCamera& novel,
                         dtr::RenderOptions options, dtr::RenderMethod method) {
  options.method = method;
  dtr::gl::Renderer renderer;
  return LeastMilliseconds(
      [&] { renderer.Draw(scene, novel.camera, novel.cam_from_world, options); });
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "gl_bench SET.dtr [K] [R]\n");
    return 2;
  }
  const dtr::DtrSet set = dtr::io::LoadSet(argv[1], {.completed = true});
  const dtr::RenderScene scene = dtr::MakeRenderScene(set);
  const dtr::NovelCamera novel = dtr::FlyThrough(set, 9)[4];
  dtr::RenderOptions options;
  options.method = dtr::RenderMethod::kTwoPass;
  if (argc > 2) options.views = std::atoi(argv[2]);
  if (argc > 3) options.resolution = std::atoi(argv[3]);
  const dtr::gl::EglContext context;
  dtr::RenderFrame frame{scene, novel.camera, options, false, {}, {}, {}};
  double triangles = 0;
  for (const int index : dtr::SelectViews(scene, novel.cam_from_world, options).views) {
    const dtr::View& view = *scene.views[static_cast<size_t>(index)];
    frame.views.push_back(&view);
    frame.placements.push_back(dtr::PlaceView(view, novel.cam_from_world));
    triangles += static_cast<double>(dtr::gl::MakeViewMesh(view, options).indices.size() / 3);
  }
  const double ms = DrawingMilliseconds(frame);
  std::printf("%s; %dx%d, R %d: %.2f M triangles from %zu views, %.1f CPU ms, %.1f ns each\n",
              context.Description().c_str(), novel.camera.width_px(), novel.camera.height_px(),
              options.resolution, 1e-6 * triangles, frame.views.size(), ms, 1e6 * ms / triangles);
  const auto whole = [&](dtr::RenderMethod method) {
    return FrameMilliseconds(scene, novel, options, method);
  };
  const double two_pass = whole(dtr::RenderMethod::kTwoPass);
  const double deferred = whole(dtr::RenderMethod::kDeferred);
  std::printf(
      "whole frames: two passes %.1f CPU ms (%.1f ns a triangle, %.1f for each of its two passes), "
      "deferred %.1f (%.1f times as fast)\n",
      two_pass, 1e6 * two_pass / triangles, 0.5e6 * two_pass / triangles, deferred,
      two_pass / deferred);
  return 0;
}
