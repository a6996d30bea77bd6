// The founding report's operations by name, its keys, and the conversions of cameras.
#include "tests/gl/gl_testing.h"
// clang-format keeps this group apart.
#include <osgGA/GUIEventAdapter>

#include <cmath>
#include <numbers>

#include "dtr/base/error.h"
#include "dtr/cpu/renderer.h"
#include "dtr/io/image_io.h"
#include "tests/osg/osg_testing.h"
#include "tests/support/test_data.h"
#include "viewer/osg/depth_tr.h"
#include "viewer/osg/key_handler.h"
#include "viewer/osg/novel_camera.h"

namespace dtr::testing {
namespace {

using osgDTR::DepthTR;

osg::ref_ptr<DepthTR> SquareNode() {
  osg::ref_ptr<DepthTR> node = new DepthTR;
  node->setScene(SquareBeforePlane());
  return node;
}

Shot Ahead() { return ShotFrom("n", {0.17, 0.11, 0.3}, {0.2, -0.1, 10}); }

TEST(NovelCamera, GoesThroughOpenSceneGraphsMatricesAndBack) {
  const PinholeCamera camera(320, 200, 280.5, 271.25, 150.5, 108.75);
  const Pose pose = Ahead().cam_from_world;
  const auto novel = osgDTR::NovelCameraOf(osgDTR::ViewMatrixOf(pose),
                                           osgDTR::ProjectionMatrixOf(camera, 0.5, 90), 320, 200);
  EXPECT_NEAR(novel.camera.fx_px(), camera.fx_px(), 1e-10);
  EXPECT_NEAR(novel.camera.fy_px(), camera.fy_px(), 1e-10);
  EXPECT_NEAR(novel.camera.cx_px(), camera.cx_px(), 1e-10);
  EXPECT_NEAR(novel.camera.cy_px(), camera.cy_px(), 1e-10);
  EXPECT_LT(novel.cam_from_local.rotation.angularDistance(pose.rotation), 1e-12);
  EXPECT_LT((novel.cam_from_local.translation - pose.translation).norm(), 1e-12);
  // Device z of the near plane is -1, of the far plane 1.
  const auto device = [&](double z) {
    return novel.projection.at_infinity + novel.projection.per_inverse_depth / z;
  };
  EXPECT_NEAR(device(0.5), -1, 1e-12);
  EXPECT_NEAR(device(90), 1, 1e-12);
}

TEST(NovelCamera, APointIsSeenWhereOpenSceneGraphSeesIt) {
  const osg::Matrixd modelview = osg::Matrixd::scale(2, 2, 2) *
                                 osg::Matrixd::rotate(0.3, osg::Vec3d(1, 2, 3)) *
                                 osg::Matrixd::translate(0.2, -0.3, -9);
  const osg::Matrixd projection = osg::Matrixd::frustum(-0.3, 0.5, -0.2, 0.4, 0.7, 50);
  const auto novel = osgDTR::NovelCameraOf(modelview, projection, 640, 480);
  const osg::Vec3d point(0.3, 0.8, -0.4);
  const osg::Vec3d device = point * modelview * projection;
  const Eigen::Vector3d in_cam =
      novel.cam_from_local * Eigen::Vector3d(point.x(), point.y(), point.z());
  const auto pixel = novel.camera.PixelFromCam(in_cam);
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), 320 * (1 + device.x()), 1e-9);
  EXPECT_NEAR(pixel->y(), 240 * (1 - device.y()), 1e-9);
  EXPECT_NEAR(novel.projection.at_infinity + novel.projection.per_inverse_depth / in_cam.z(),
              device.z(), 1e-12);
}

TEST(NovelCamera, WhatIsNoPinholeCameraIsRejected) {
  const osg::Matrixd good = osg::Matrixd::perspective(40, 1.5, 1, 100), none;
  osg::Matrixd skewed = good;
  skewed(1, 0) = 0.1;
  for (const osg::Matrixd& projection :
       {osg::Matrixd::ortho(-1, 1, -1, 1, 1, 9), skewed, good * osg::Matrixd::scale(-1, 1, 1)}) {
    EXPECT_THROW(osgDTR::NovelCameraOf(none, projection, 64, 48), Error);
  }
  for (const osg::Matrixd& modelview :
       {osg::Matrixd::scale(1, 1, 1.01), osg::Matrixd::scale(0, 0, 0), good}) {
    EXPECT_THROW(osgDTR::NovelCameraOf(modelview, good, 64, 48), Error);
  }
}

TEST(Report, TheNovelViewIsTheReferenceRenderers) {
  const DtrSet set = SquareBeforePlane();
  const osg::ref_ptr<DepthTR> node = SquareNode();
  const Shot novel = Ahead();
  const Eigen::Matrix3d r = novel.cam_from_world.rotation.toRotationMatrix();
  double model[3][4], calib[3][3] = {{novel.camera.fx_px(), 0, novel.camera.cx_px()},
                                     {0, novel.camera.fy_px(), novel.camera.cy_px()},
                                     {0, 0, 1}};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) model[i][j] = r(i, j);
    model[i][3] = novel.cam_from_world.translation[i];
  }
  node->setNovelView(model, calib, novel.camera.width_px(), novel.camera.height_px());
  for (const BlendWeight blend : kAllWeights) {
    const osg::ref_ptr<osg::Image> image = node->getNovelView(blend, 3);
    RenderOptions options;
    options.blend = blend;
    options.views = 3;
    const RenderResult expected =
        cpu::Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options);
    EXPECT_LE(LargestDifference(node->getNovelResult().image, expected.image), 1);
    EXPECT_EQ(image->data(5, image->t() - 1 - 7)[1], node->getNovelResult().image(5, 7, 1));
    double sum = 0;
    for (const auto& view : node->inputViews()) sum += view.weight;
    EXPECT_NEAR(sum, 1, 1e-12);
  }
  model[0][0] += 0.1;
  EXPECT_THROW(node->setNovelView(model, calib, 8, 8), UsageError);
}

TEST(Report, SetNovelViewSaysWhichViewsAreValid) {
  const osg::ref_ptr<DepthTR> node = SquareNode();
  RenderOptions narrow;
  narrow.max_angle_rad = 0.06;
  node->setRenderOptions(narrow);
  const Shot novel = ShotFrom("n", {-1, 0, 0}, {0, 0, 10});  // at the first view
  node->setNovelView(novel.camera, novel.cam_from_world);
  EXPECT_TRUE(node->inputViews()[0].valid);
  EXPECT_NEAR(node->inputViews()[0].angle, 0, 1e-9);
  EXPECT_FALSE(node->inputViews()[4].valid);  // 2 / 10 rad away
}

TEST(Report, AViewProjectedIntoItsOwnCameraIsItsPhoto) {
  const osg::ref_ptr<DepthTR> node = SquareNode();
  const View& view = node->inputViews()[2].view();
  node->setNovelView(view.camera, view.cam_from_world);
  EXPECT_THROW(node->getProjectedDT(2), std::logic_error);
  const TemporaryFolder folder;
  for (const osgDTR::Mode mode : {osgDTR::TRIANGULATION, osgDTR::SPLATTING}) {
    node->projectView(2, mode, 1, 1);
    const osgDTR::ProjectedView& projected = node->getProjectedDT(2);
    int seen = 0;
    for (int y = 0; y < view.image.height(); ++y) {
      for (int x = 0; x < view.image.width(); ++x) {
        if (projected.holes(x, y) != 0) continue;
        ++seen;
        ASSERT_LE(PixelDifference(projected.projectedImage, view.image, x, y), 1);
        ASSERT_NEAR(projected.projectedDepth(x, y), view.depth(x, y), 1e-3);
      }
    }
    EXPECT_GT(seen, 0.9 * view.image.width() * view.image.height());
    node->saveProjectedImage(2, (folder / "v.png").string());
    EXPECT_LE(LargestDifference(io::ReadImage(folder / "v.png"), projected.projectedImage), 0);
  }
  EXPECT_THROW(node->projectView(5, osgDTR::SPLATTING, 1, 1), UsageError);
}

TEST(Report, BlendFunctionsAreTheirFormulas) {
  const osg::ref_ptr<DepthTR> node = new DepthTR;  // needs no scene
  const std::vector<double> t{0.1, 0.3, 0.2, 0.5};
  const std::vector<bool> flags{true, true, false, true};
  const std::vector<int> positions{0, 1, 2};
  const RenderOptions o;
  std::vector<double> w;
  const auto expect = [&](double a, double b) {
    ASSERT_EQ(w.size(), 4U);
    EXPECT_NEAR(w[0], a / (a + b), 1e-12);
    EXPECT_NEAR(w[1], b / (a + b), 1e-12);
    EXPECT_EQ(w[2], 0);
    EXPECT_EQ(w[3], 0);
  };
  node->cosAngleBlending(t, w, flags, positions);
  expect(std::pow(std::cos(0.1), 8), std::pow(std::cos(0.3), 8));
  node->exponentialAngleBlending(t, w, flags, positions);
  expect(std::exp(-o.falloff * 0.1), std::exp(-o.falloff * 0.3));
  node->angleBlending(t, w, flags, positions);
  expect(1 - 0.1 / o.max_angle_rad, 1 - 0.3 / o.max_angle_rad);
  node->newAngleBlending(1, t, w, flags, positions);
  expect(1 - 0.1 / 0.3, 0);
  node->inverseAngleBlending(3, t, w, flags, positions);
  const double pixel = std::atan(1 / 1000.0);
  expect(std::pow(0.1 + pixel, -3), std::pow(0.3 + pixel, -3));
  // The nearest two of the flagged.
  node->computeWeights(2, BlendWeight::kCosine, t, w, flags);
  expect(std::pow(std::cos(0.1), 8), std::pow(std::cos(0.3), 8));
  EXPECT_THROW(node->cosAngleBlending(t, w, {true}, positions), UsageError);
  EXPECT_THROW(node->cosAngleBlending(t, w, flags, {4}), UsageError);
}

TEST(Report, LoadRejectsWhatIsNoSetAndKeepsWhatWasThere) {
  const osg::ref_ptr<DepthTR> node = SquareNode();
  EXPECT_THROW(node->load("/nowhere.dtr"), Error);
  EXPECT_EQ(node->numberOfInputViews(), 5);
  RenderOptions none;
  none.views = 0;
  EXPECT_THROW(node->setRenderOptions(none), UsageError);
}

TEST(Report, ACopySharesTheSetAndHasOptionsOfItsOwn) {
  const osg::ref_ptr<DepthTR> node = SquareNode();
  const osg::ref_ptr<DepthTR> copy = osg::clone(node.get(), osg::CopyOp::DEEP_COPY_ALL);
  EXPECT_EQ(copy->getScene(), node->getScene());
  EXPECT_EQ(copy->getNumDrawables(), 1U);
  EXPECT_EQ(copy->numberOfInputViews(), 5);
  EXPECT_NE(copy->getDtrDrawable(), node->getDtrDrawable());
  copy->setMode(osgDTR::SPLATTING);
  EXPECT_EQ(node->getRenderOptions().method, RenderMethod::kDeferred);
}

/// What a handler asks of a viewer.
class FakeViewer : public osgGA::GUIActionAdapter {
 public:
  void requestRedraw() override { ++redraws; }
  void requestContinuousUpdate(bool) override {}
  void requestWarpPointer(float, float) override {}
  int redraws = 0;
};

TEST(Keys, ChangeWhatTheReportsKeysChange) {
  const osg::ref_ptr<DepthTR> node = SquareNode();
  const osg::ref_ptr<osgDTR::KeyHandler> handler = new osgDTR::KeyHandler(node.get());
  FakeViewer viewer;
  const auto press = [&](int key) {
    const osg::ref_ptr<osgGA::GUIEventAdapter> event = new osgGA::GUIEventAdapter;
    event->setEventType(osgGA::GUIEventAdapter::KEYDOWN);
    event->setKey(key);
    return handler->handle(*event, viewer);
  };
  EXPECT_TRUE(press('r'));
  EXPECT_EQ(node->getRenderOptions().resolution, 2);
  const BlendWeight before = node->getRenderOptions().blend;
  EXPECT_TRUE(press('v'));
  EXPECT_NE(node->getRenderOptions().blend, before);
  EXPECT_TRUE(press('k'));
  EXPECT_EQ(node->getRenderOptions().method, RenderMethod::kTwoPass);
  EXPECT_TRUE(press('k'));
  EXPECT_EQ(node->getRenderOptions().primitive, Primitive::kSplat);
  EXPECT_TRUE(press('k'));
  EXPECT_EQ(node->getRenderOptions().method, RenderMethod::kDeferred);
  EXPECT_TRUE(press('['));
  EXPECT_EQ(node->getRenderOptions().views, 5);  // of 8, where there are 5
  EXPECT_TRUE(press('u'));
  EXPECT_TRUE(node->getRenderOptions().fill_holes);
  EXPECT_EQ(node->getFillTime(), osgDTR::FillTime::kWhenStill);
  EXPECT_TRUE(press('u'));
  EXPECT_TRUE(node->getRenderOptions().fill_holes);
  EXPECT_EQ(node->getFillTime(), osgDTR::FillTime::kAlways);
  EXPECT_TRUE(press('u'));
  EXPECT_FALSE(node->getRenderOptions().fill_holes);
  EXPECT_TRUE(press('x'));
  EXPECT_EQ(node->getDrawPath(), osgDTR::DrawPath::kReadBack);
  EXPECT_FALSE(press('q'));
  EXPECT_EQ(viewer.redraws, 10);
}

}  // namespace
}  // namespace dtr::testing
