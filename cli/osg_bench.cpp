#include "cli/osg_bench.h"

#include <fmt/format.h>
#include <osgViewer/Viewer>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "dtr/base/error.h"
#include "dtr/gl/context.h"
#include "dtr/gl/fitting_renderer.h"
#include "dtr/gl/frame_timer.h"
#include "viewer/osg/depth_tr.h"
#include "viewer/osg/novel_camera.h"

namespace dtr::cli {
namespace {

constexpr int kReadBackFrames = 3;  // a second each, or more

/// A frame is over when its pixels are there.
class WaitCallback : public osg::Camera::DrawCallback {
 public:
  void operator()(osg::RenderInfo&) const override { gl::WaitForGpu(); }
};

/// A viewer as any program's. It draws into a framebuffer object: what it takes to bring pixels to
/// a screen is not the scene graph's, and dtr/gl alone does not do it.
class Host {
 public:
  Host(osgDTR::DepthTR* node, const PinholeCamera& camera) : camera_(camera) {
    const char* const display = std::getenv("DISPLAY");  // without one, OSG would take ":0"
    osg::ref_ptr<osg::GraphicsContext::Traits> traits = new osg::GraphicsContext::Traits;
    traits->readDISPLAY();
    traits->width = camera.width_px();
    traits->height = camera.height_px();
    traits->pbuffer = true;
    if (display != nullptr && *display != 0) {
      context_ = osg::GraphicsContext::createGraphicsContext(traits.get());
    }
    if (!context_) {
      throw Error(
          "bench --table osg: expected a display for OpenSceneGraph's window, found none; set "
          "DISPLAY, or: xvfb-run -a dtr bench SET --table osg");
    }
    viewer_.setThreadingModel(osgViewer::ViewerBase::SingleThreaded);
    // The context stays current between frames, for dtr/gl to draw in, too.
    viewer_.setReleaseContextAtEndOfFrameHint(false);
    osg::Camera* const view = viewer_.getCamera();
    view->setGraphicsContext(context_);
    view->setViewport(0, 0, camera.width_px(), camera.height_px());
    view->setRenderTargetImplementation(osg::Camera::FRAME_BUFFER_OBJECT);
    view->attach(osg::Camera::COLOR_BUFFER, GL_RGBA8);
    view->attach(osg::Camera::DEPTH_BUFFER, GL_DEPTH_COMPONENT24);
    view->setProjectionMatrix(osgDTR::ProjectionMatrixOf(camera, 1, 100));
    view->setFinalDrawCallback(new WaitCallback);
    viewer_.setSceneData(node);
    viewer_.realize();
  }

  eval::FrameTime Draw(const Pose& cam_from_world) {
    viewer_.getCamera()->setViewMatrix(osgDTR::ViewMatrixOf(cam_from_world));
    const eval::StopWatch watch;
    viewer_.frame();
    return watch.Elapsed();
  }
  void MakeCurrent() { context_->makeCurrent(); }
  const PinholeCamera& camera() const { return camera_; }

 private:
  const PinholeCamera camera_;
  osg::ref_ptr<osg::GraphicsContext> context_;
  osgViewer::Viewer viewer_;
};

/// dtr/gl without a scene graph, as the node uses it.
eval::FrameTime DrawAlone(gl::FittingRenderer& renderer, const RenderScene& scene, const Host& host,
                          const Pose& cam_from_world, const RenderOptions& options,
                          int& views_used) {
  const eval::StopWatch watch;
  const gl::DrawnFrame picture = renderer.Draw(scene, host.camera(), cam_from_world, options);
  gl::WaitForGpu();
  const eval::FrameTime time = watch.Elapsed();
  views_used = std::max(views_used, static_cast<int>(picture.views_used.size()));
  return time;
}

OsgRow MeasureRow(const RenderOptions& options, const std::vector<NovelCamera>& path, Host& host,
                  osgDTR::DepthTR& node, gl::FittingRenderer& alone) {
  node.setDrawPath(osgDTR::DrawPath::kGpu);
  node.setRenderOptions(options);
  OsgRow row;
  row.options = options;
  eval::FrameTimes on_osg, by_gl;
  const RenderScene& scene = node.getScene()->scene;
  for (const bool counted : {false, true}) {
    for (const NovelCamera& novel : path) {
      const eval::FrameTime osg_time = host.Draw(novel.cam_from_world);
      host.MakeCurrent();
      gl::WaitForGpu();
      const eval::FrameTime gl_time =
          DrawAlone(alone, scene, host, novel.cam_from_world, options, row.views_used);
      if (!counted) continue;
      on_osg.Add(osg_time);
      by_gl.Add(gl_time);
    }
  }
  row.gl = by_gl.Frame();
  row.gl_cpu = by_gl.Cpu();
  row.osg = on_osg.Frame();
  row.osg_cpu = on_osg.Cpu();
  return row;
}

OsgRow MeasureReadBack(const OsgRow& like, const std::vector<NovelCamera>& path, Host& host,
                       osgDTR::DepthTR& node) {
  OsgRow row = like;
  row.read_back = true;
  row.options.method = RenderMethod::kTwoPass;
  node.setRenderOptions(row.options);
  node.setDrawPath(osgDTR::DrawPath::kReadBack);
  eval::FrameTimes times;
  for (int i = 0; i < kReadBackFrames + 1; ++i) {
    const eval::FrameTime time =
        host.Draw(path[static_cast<size_t>(i) % path.size()].cam_from_world);
    if (i > 0) times.Add(time);
  }
  row.gl = row.gl_cpu = {};
  row.osg = times.Frame();
  row.osg_cpu = times.Cpu();
  return row;
}

}  // namespace

OsgBench MeasureOnOsg(DtrSet set, const std::vector<NovelCamera>& path,
                      const std::vector<RenderOptions>& variants, const Progress& progress) {
  osg::ref_ptr<osgDTR::DepthTR> node = new osgDTR::DepthTR;
  node->setScene(std::move(set));
  Host host(node.get(), path.front().camera);
  host.MakeCurrent();
  OsgBench bench;
  bench.renderer = gl::CurrentContextDescription();
  bench.width_px = host.camera().width_px();
  bench.height_px = host.camera().height_px();
  bench.frames = static_cast<int>(path.size());
  bench.drawn_by_processor = !gl::FrameTimer().has_gpu_clock();
  {
    gl::FittingRenderer alone;
    for (const RenderOptions& options : variants) {
      progress.ThrowIfInterrupted();
      bench.rows.push_back(MeasureRow(options, path, host, *node, alone));
    }
    host.MakeCurrent();
  }
  bench.rows.push_back(MeasureReadBack(bench.rows.front(), path, host, *node));
  return bench;
}

void SayOsgTable(const OsgBench& bench, const eval::BenchMachine& machine, Console& console) {
  console.Say(fmt::format("{}; {}, {} cores; dtr {}", machine.renderer, machine.cpu, machine.cores,
                          machine.version));
  console.Say(fmt::format("{}x{}, medians of {} frames of a fly-through; ratio by {} time",
                          bench.width_px, bench.height_px, bench.frames, machine.clock));
  console.Say("");
  console.Say(fmt::format("{:<22} {:>3} {:>5} {:>10} {:>9} {:>8} {:>10} {:>9} {:>6}", "Application",
                          "R", "views", "s a frame", "ms", "CPU ms", "alone ms", "CPU ms",
                          "ratio"));
  for (const OsgRow& row : bench.rows) {
    std::string line = fmt::format("{:<22} {:>3} {:>5} {:>10.4f} {:>9.1f} {:>8.1f}",
                                   row.read_back ? "D+TR on OSG, read back" : "D+TR on OSG",
                                   row.options.resolution, row.views_used, row.osg.median_ms / 1000,
                                   row.osg.median_ms, row.osg_cpu.median_ms);
    if (!row.read_back) {
      line += fmt::format(" {:>10.1f} {:>9.1f} {:>6.3f}", row.gl.median_ms, row.gl_cpu.median_ms,
                          bench.RatioOsgOverGl(row));
    }
    console.Say(line);
  }
}

std::string OsgJson(const OsgBench& bench, const eval::BenchMachine& machine) {
  using nlohmann::ordered_json;
  ordered_json rows = ordered_json::array();
  double largest = 0;
  for (const OsgRow& row : bench.rows) {
    ordered_json json{
        {"path", row.read_back ? "read-back" : "gpu"},
        {"method", row.options.method == RenderMethod::kTwoPass ? "two-pass" : "deferred"},
        {"views_used", row.views_used},
        {"resolution", row.options.resolution},
        {"seconds_per_frame", row.osg.median_ms / 1000},
        {"ms", row.osg.median_ms},
        {"spread_ms", row.osg.spread_ms},
        {"cpu_ms", row.osg_cpu.median_ms},
        {"gl_ms", nullptr},
        {"gl_cpu_ms", nullptr},
        {"ratio_osg_over_gl", nullptr}};
    if (!row.read_back) {
      json["gl_ms"] = row.gl.median_ms;
      json["gl_cpu_ms"] = row.gl_cpu.median_ms;
      json["ratio_osg_over_gl"] = bench.RatioOsgOverGl(row);
      largest = std::max(largest, bench.RatioOsgOverGl(row));
    }
    rows.push_back(json);
  }
  return ordered_json{{"table", "osg"},
                      {"width_px", bench.width_px},
                      {"height_px", bench.height_px},
                      {"frames", bench.frames},
                      {"rows", rows},
                      {"largest_ratio_osg_over_gl", largest},
                      {"machine",
                       {{"cpu", machine.cpu},
                        {"cores", machine.cores},
                        {"renderer", machine.renderer},
                        {"version", machine.version},
                        {"clock", machine.clock}}}}
      .dump(1);
}

}  // namespace dtr::cli
