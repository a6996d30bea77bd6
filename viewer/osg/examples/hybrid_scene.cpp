// A hybrid scene: the founding report's road, truck and boxes (its section 3.1.1, figures 14 to 19)
// in a courtyard of depth images. `osgdtr_hybrid SET.dtr` opens a window; with a second argument it
// writes one image instead and ends, or the models alone where that ends in .osgt: then
// `osgviewer SET.dtr FILE.osgt` shows the same. docs/OSG.md says how the set is made.
#include <osg/Geode>
#include <osg/PositionAttitudeTransform>
#include <osg/ShapeDrawable>
#include <osgDB/FileNameUtils>
#include <osgDB/WriteFile>
#include <osgViewer/Viewer>

#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>

#include "viewer/osg/depth_tr.h"
#include "viewer/osg/key_handler.h"

namespace {

constexpr int kImageWidth = 960, kImageHeight = 640;

osg::ref_ptr<osg::ShapeDrawable> Colored(osg::Shape* shape, const osg::Vec4& color) {
  osg::ref_ptr<osg::ShapeDrawable> drawable = new osg::ShapeDrawable(shape);
  drawable->setColor(color);
  return drawable;
}

/// A node with `child` placed below it: the report's PositionAttitudeTransform. z is up.
osg::ref_ptr<osg::PositionAttitudeTransform> Placed(osg::Node* child, const osg::Vec3d& position,
                                                    double turn_rad = 0) {
  osg::ref_ptr<osg::PositionAttitudeTransform> placed = new osg::PositionAttitudeTransform;
  placed->setPosition(position);
  placed->setAttitude(osg::Quat(turn_rad, osg::Vec3d(0, 0, 1)));
  placed->addChild(child);
  return placed;
}

/// 2.4 long, along x, on wheels that touch z = 0.
osg::ref_ptr<osg::Geode> Truck() {
  const osg::Vec4 red(0.75F, 0.12F, 0.08F, 1), dark(0.08F, 0.08F, 0.09F, 1),
      grey(0.35F, 0.36F, 0.38F, 1), glass(0.55F, 0.70F, 0.80F, 1);
  osg::ref_ptr<osg::Geode> truck = new osg::Geode;
  truck->addDrawable(Colored(new osg::Box({0, 0, 0.38F}, 2.4F, 0.9F, 0.12F), grey));
  truck->addDrawable(Colored(new osg::Box({0.85F, 0, 0.80F}, 0.7F, 0.9F, 0.75F), red));
  truck->addDrawable(Colored(new osg::Box({1.0F, 0, 0.95F}, 0.42F, 0.8F, 0.30F), glass));
  truck->addDrawable(Colored(new osg::Box({0.93F, 0, 0.95F}, 0.45F, 0.92F, 0.28F), glass));
  for (const float side : {-0.42F, 0.42F}) {
    truck->addDrawable(Colored(new osg::Box({-0.4F, side, 0.53F}, 1.6F, 0.06F, 0.2F), red));
    for (const float x : {-0.8F, 0.8F}) {
      osg::ref_ptr<osg::Cylinder> wheel = new osg::Cylinder({x, side, 0.24F}, 0.24F, 0.16F);
      wheel->setRotation(osg::Quat(osg::PI_2, osg::Vec3d(1, 0, 0)));
      truck->addDrawable(Colored(wheel, dark));
    }
  }
  return truck;
}

osg::ref_ptr<osg::Geode> Box() {
  osg::ref_ptr<osg::Geode> box = new osg::Geode;
  box->addDrawable(Colored(new osg::Box({0, 0, 0.35F}, 0.7F), {0.85F, 0.65F, 0.15F, 1}));
  box->addDrawable(
      Colored(new osg::Box({0, 0, 0.35F}, 0.72F, 0.12F, 0.72F), {0.2F, 0.25F, 0.6F, 1}));
  return box;
}

/// Figure 16: the truck under a translation with a box on it, the same box once more on the ground.
osg::ref_ptr<osg::Group> Models() {
  const osg::ref_ptr<osg::Geode> truck = Truck(), box = Box();
  osg::ref_ptr<osg::Group> loaded_truck = new osg::Group;
  loaded_truck->addChild(truck);
  loaded_truck->addChild(Placed(box, {-0.45, 0, 0.44}, 0.2));
  osg::ref_ptr<osg::Group> scene = new osg::Group;
  // Behind the fountain, which hides part of it; the box stands before the wall.
  scene->addChild(Placed(loaded_truck, {-0.4, 4.75, 0}, 0.15));
  scene->addChild(Placed(box, {1.5, 1.5, 0}, 0.6));
  return scene;
}

void WriteImage(osgViewer::Viewer& viewer, const std::string& file) {
  osg::ref_ptr<osg::GraphicsContext::Traits> traits = new osg::GraphicsContext::Traits;
  traits->readDISPLAY();
  traits->width = kImageWidth;
  traits->height = kImageHeight;
  traits->pbuffer = true;
  osg::Camera* const camera = viewer.getCamera();
  camera->setGraphicsContext(osg::GraphicsContext::createGraphicsContext(traits.get()));
  camera->setViewport(0, 0, kImageWidth, kImageHeight);
  camera->setRenderTargetImplementation(osg::Camera::FRAME_BUFFER_OBJECT);
  camera->setProjectionMatrixAsPerspective(44, static_cast<double>(kImageWidth) / kImageHeight, 1,
                                           100);
  const osg::ref_ptr<osg::Image> image = new osg::Image;
  image->allocateImage(kImageWidth, kImageHeight, 1, GL_RGB, GL_UNSIGNED_BYTE);
  camera->attach(osg::Camera::COLOR_BUFFER, image.get());
  viewer.setThreadingModel(osgViewer::ViewerBase::SingleThreaded);
  for (int frame = 0; frame < 3; ++frame) viewer.frame();
  osg::ref_ptr<osgDB::Options> options = new osgDB::Options("JPEG_QUALITY 88");
  if (!osgDB::writeImageFile(*image, file, options)) {
    throw std::runtime_error(file + ": expected an image that can be written, found none");
  }
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 2 || argc > 3) {
    std::fprintf(stderr, "usage: osgdtr_hybrid SET.dtr [PICTURE.jpg|MODELS.osgt]\n");
    return 2;
  }
  const osg::ref_ptr<osgDTR::DepthTR> courtyard = new osgDTR::DepthTR;
  courtyard->load(argv[1]);
  osgViewer::Viewer viewer;
  const osg::ref_ptr<osg::Group> models = Models();
  if (argc == 3 && osgDB::getLowerCaseFileExtension(argv[2]) == "osgt") {
    if (osgDB::writeNodeFile(*models, argv[2])) return 0;
    throw std::runtime_error(std::string(argv[2]) +
                             ": expected a file that can be written, found none");
  }
  const osg::ref_ptr<osg::Group> scene = new osg::Group;
  scene->addChild(courtyard);
  scene->addChild(models);
  viewer.setSceneData(scene);
  viewer.getCamera()->setClearColor({0.55F, 0.68F, 0.82F, 1});
  // In the eye's coordinates: from the upper left, as the courtyard's sun.
  viewer.getLight()->setPosition({-0.4F, 0.6F, 0.7F, 0});
  viewer.getLight()->setDiffuse({1.1F, 1.1F, 1.05F, 1});
  viewer.getLight()->setAmbient({0.35F, 0.35F, 0.4F, 1});
  if (argc == 3) {
    viewer.getCamera()->setViewMatrix(
        courtyard->getInputViewMatrix(courtyard->numberOfInputViews() / 2));
    WriteImage(viewer, argv[2]);
    return 0;
  }
  viewer.addEventHandler(new osgDTR::KeyHandler(courtyard.get(), true));
  return viewer.run();
} catch (const std::exception& error) {
  std::fprintf(stderr, "osgdtr_hybrid: %s\n", error.what());
  return 1;
}
