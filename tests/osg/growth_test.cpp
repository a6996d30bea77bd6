// 10 000 frames in OpenSceneGraph leave nothing behind.
#include "tests/gl/gl_testing.h"
#include "tests/simd/exact_scenes.h"
// clang-format keeps this group apart.
#include <osg/PositionAttitudeTransform>

#include <cmath>
#include <cstdio>

#include "dtr/base/machine.h"
#include "tests/osg/osg_testing.h"
#include "viewer/osg/depth_tr.h"

namespace dtr::testing {
namespace {

constexpr int kFrames = 10000, kSettled = 2000;
// 256 bytes a frame. Images here take 77 KB: one leaked in each frame would be 600 MB.
constexpr double kMaxGrowthBytes = 256.0 * (kFrames - kSettled);

using GrowthTest = OsgTest;

/// Twice in the window, moving and resting, with options that change and holes that are filled:
/// images come and go in all ways there are.
TEST_F(GrowthTest, TenThousandFramesLeaveNothingBehind) {
  const NamedScene named = ExactScene("courtyard", 5, 120, 80);
  osg::ref_ptr<osgDTR::DepthTR> node = new osgDTR::DepthTR;
  node->setScene(named.set);
  node->setFillTime(osgDTR::FillTime::kWhenStill);
  osg::ref_ptr<osg::Group> scene = new osg::Group;
  osg::ref_ptr<osg::PositionAttitudeTransform> second = new osg::PositionAttitudeTransform;
  second->setPosition({0, 0, 3});
  second->addChild(node);
  scene->addChild(node);
  OffscreenViewer viewer(scene.get(), named.novel.camera, named.novel.cam_from_world);
  viewer.viewer.getCamera()->setFinalDrawCallback(nullptr);  // nobody looks
  size_t settled = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    Pose pose = named.novel.cam_from_world;
    pose.translation.x() += 0.2 * std::sin(0.01 * frame);
    if (frame % 100 < 90) viewer.Look(pose);  // and rests for ten
    if (frame % 250 == 0) {
      RenderOptions options;
      options.views = 1 + frame / 250 % 4;
      options.fill_holes = frame % 500 == 0;
      node->setRenderOptions(options);
    }
    if (frame % 400 == 0) scene->addChild(second);
    if (frame % 400 == 200) scene->removeChild(second);
    viewer.viewer.frame();
    if (frame + 1 == kSettled) settled = MemoryBytes();
    if ((frame + 1) % 1000 == 0) {
      std::printf("%5d frames: %.1f MB held\n", frame + 1,
                  static_cast<double>(MemoryBytes()) / 1e6);
    }
  }
  EXPECT_LT(static_cast<double>(MemoryBytes()) - static_cast<double>(settled), kMaxGrowthBytes);
}

}  // namespace
}  // namespace dtr::testing
