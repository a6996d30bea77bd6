#include "cli/osg_bench.h"

#include <osgViewer/Viewer>

#include <algorithm>
#include <cstdlib>

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

}  // namespace dtr::cli
