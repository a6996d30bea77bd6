// gl_bench SET.dtr [K] [R]: the least CPU time, per triangle, of laying down the views' full meshes
// (SPEC 4.2) from the middle of the set's own path, without the resolving pass. What `dtr bench`
// times are whole frames; this is the share of the driver's triangle set-up in them.
#include <epoxy/gl.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "dtr/eval/timed_renderer.h"
#include "dtr/gl/context.h"
#include "dtr/gl/driver.h"
#include "dtr/gl/two_pass.h"
#include "dtr/gl/view_mesh.h"
#include "dtr/io/set_io.h"
#include "dtr/render/camera_path.h"
#include "dtr/render/valid_views.h"

namespace {

constexpr int kFrames = 5;

double DrawingMilliseconds(const dtr::gl::Frame& frame) {
  const dtr::gl::StateGuard guard;
  dtr::gl::ViewStore store;
  dtr::gl::ProgramCache programs("");
  dtr::gl::Targets targets;
  store.Prepare(frame.views, frame.options);
  const dtr::gl::Band band{0, frame.novel.height_px()};
  targets.Fit(frame.novel.width_px(), band.count, static_cast<int>(frame.views.size()));
  std::vector<double> times;
  for (int i = 0; i <= kFrames; ++i) {
    const dtr::eval::StopWatch watch;
    dtr::gl::DrawViewLayers(frame, band, store, programs, targets, dtr::gl::HasClipControl());
    glFinish();
    if (i > 0) times.push_back(watch.Elapsed().cpu_ms);  // the first warms up
  }
  return *std::min_element(times.begin(), times.end());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "gl_bench SET.dtr [K] [R]\n");
    return 2;
  }
  const dtr::DtrSet set = dtr::io::LoadSet(argv[1]);
  const dtr::RenderScene scene = dtr::MakeRenderScene(set);
  const dtr::NovelCamera novel = dtr::FlyThrough(set, 9)[4];
  dtr::RenderOptions options;
  options.method = dtr::RenderMethod::kTwoPass;
  if (argc > 2) options.views = std::atoi(argv[2]);
  if (argc > 3) options.resolution = std::atoi(argv[3]);
  const dtr::gl::EglContext context;
  dtr::gl::Frame frame{scene, novel.camera, options, false, false, {}, {}, {}};
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
  return 0;
}
