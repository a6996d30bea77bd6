// tests/osg/osg_testing.h -- windows of OpenSceneGraph without a screen, and what they show.
#pragma once
#include <gtest/gtest.h>
#include <osg/Camera>
#include <osg/Geode>
#include <osg/Image>
#include <osg/ShapeDrawable>
#include <osgViewer/Viewer>

#include <memory>

#include "dtr/types/camera.h"
#include "dtr/types/depth_image.h"
#include "dtr/types/grid.h"
#include "tests/support/virtual_display.h"
#include "viewer/osg/novel_camera.h"

namespace dtr::testing {

/// What lies in a framebuffer: colour and the depth buffer's values in [0, 1], top row first.
struct Shown {
  ImageRgb8 image;
  Grid<float> depth;
};

/// Reads back at the end of every frame.
class ReadBackCallback : public osg::Camera::DrawCallback {
 public:
  ReadBackCallback(int width, int height) : width_(width), height_(height) {}
  void operator()(osg::RenderInfo&) const override {
    osg::ref_ptr<osg::Image> colour = new osg::Image, depth = new osg::Image;
    colour->readPixels(0, 0, width_, height_, GL_RGB, GL_UNSIGNED_BYTE);
    depth->readPixels(0, 0, width_, height_, GL_DEPTH_COMPONENT, GL_FLOAT);
    shown_ = {ImageRgb8(width_, height_, 3), Grid<float>(width_, height_)};
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const int row = height_ - 1 - y;
        for (int c = 0; c < 3; ++c) shown_.image(x, y, c) = colour->data(x, row)[c];
        shown_.depth(x, y) = *reinterpret_cast<const float*>(depth->data(x, row));
      }
    }
  }
  const Shown& shown() const { return shown_; }

 private:
  const int width_, height_;
  mutable Shown shown_;
};

inline osg::ref_ptr<osg::GraphicsContext> MakePbuffer(int width, int height,
                                                      osg::GraphicsContext* shared = nullptr) {
  osg::ref_ptr<osg::GraphicsContext::Traits> traits = new osg::GraphicsContext::Traits;
  traits->readDISPLAY();
  traits->width = width;
  traits->height = height;
  traits->pbuffer = true;
  traits->depth = 24;
  traits->sharedContext = shared;
  return osg::GraphicsContext::createGraphicsContext(traits.get());
}

/// A viewer that draws into memory, with the near and far planes that are given.
class OffscreenViewer {
 public:
  static constexpr double kNear = 0.5, kFar = 200;

  OffscreenViewer(
      osg::Node* scene, const PinholeCamera& camera, const Pose& cam_from_world,
      osgViewer::ViewerBase::ThreadingModel threading = osgViewer::ViewerBase::SingleThreaded)
      : camera_(camera), read_back_(new ReadBackCallback(camera.width_px(), camera.height_px())) {
    viewer.setThreadingModel(threading);
    osg::Camera* const view = viewer.getCamera();
    view->setGraphicsContext(MakePbuffer(camera.width_px(), camera.height_px()).get());
    view->setViewport(0, 0, camera.width_px(), camera.height_px());
    view->setDrawBuffer(GL_FRONT);
    view->setReadBuffer(GL_FRONT);
    view->setClearColor({0.1F, 0.2F, 0.3F, 1.0F});
    view->setFinalDrawCallback(read_back_.get());
    SetPlanes(kNear, kFar);
    Look(cam_from_world);
    viewer.setSceneData(scene);
  }

  void SetPlanes(double near_z, double far_z) {
    viewer.getCamera()->setComputeNearFarMode(osg::CullSettings::DO_NOT_COMPUTE_NEAR_FAR);
    viewer.getCamera()->setProjectionMatrix(osgDTR::ProjectionMatrixOf(camera_, near_z, far_z));
  }
  void Look(const Pose& cam_from_world) {
    viewer.getCamera()->setViewMatrix(osgDTR::ViewMatrixOf(cam_from_world));
  }
  /// Draws frames until one is finished that began after this call.
  const Shown& Draw(int frames = 1) {
    for (int i = 0; i < frames; ++i) viewer.frame();
    if (viewer.areThreadsRunning()) viewer.stopThreading();
    return read_back_->shown();
  }

  /// The same of one frame at this simulation time, seconds.
  const Shown& DrawAt(double simulation_time_s) {
    viewer.frame(simulation_time_s);
    if (viewer.areThreadsRunning()) viewer.stopThreading();
    return read_back_->shown();
  }

  osgViewer::Viewer viewer;

 private:
  const PinholeCamera camera_;
  osg::ref_ptr<ReadBackCallback> read_back_;
};

/// A box of plain red that nothing of the exact scenes looks like.
inline osg::ref_ptr<osg::Node> RedBox(const Eigen::Vector3d& center, const Eigen::Vector3d& half) {
  osg::ref_ptr<osg::ShapeDrawable> shape = new osg::ShapeDrawable(
      new osg::Box(osg::Vec3d(center.x(), center.y(), center.z()), static_cast<float>(2 * half.x()),
                   static_cast<float>(2 * half.y()), static_cast<float>(2 * half.z())));
  shape->setColor({1, 0, 0, 1});
  osg::ref_ptr<osg::Geode> geode = new osg::Geode;
  geode->addDrawable(shape);
  geode->getOrCreateStateSet()->setMode(GL_LIGHTING, osg::StateAttribute::OFF);
  return geode;
}

inline bool IsRed(const ImageRgb8& image, int x, int y) {
  return image(x, y, 0) > 250 && image(x, y, 1) < 5 && image(x, y, 2) < 5;
}

/// Skips where there is no X server to be had; one for the whole program.
class OsgTest : public ::testing::Test {
 protected:
  void SetUp() override {
    static VirtualDisplay* const display = new VirtualDisplay;
    if (!display->up()) GTEST_SKIP() << "no display: Xvfb is missing or did not come up";
  }
};

}  // namespace dtr::testing
