// A model of known shape stands in the courtyard: who hides whom, pixel by pixel.
#include "tests/gl/gl_testing.h"
#include "tests/simd/exact_scenes.h"
// clang-format keeps this group apart.
#include <osg/MatrixTransform>
#include <osg/PositionAttitudeTransform>
#include <osg/ShapeDrawable>

#include "datasets/primitive.h"
#include "dtr/io/image_io.h"
#include "tests/osg/osg_testing.h"
#include "viewer/osg/depth_tr.h"

namespace dtr::testing {
namespace {

using osgDTR::DepthTR;

constexpr double kRightShare = 0.995;  // of pixels farther than this from any edge:
constexpr int kEdgePx = 2;

enum class Front { kModel, kScene, kNothing };

/// In the scene's own frame.
struct KnownBox {
  Eigen::Vector3d center, half;
  double Intersect(const datasets::Ray& ray) const {
    datasets::Primitive box;
    box.center = center;
    box.half = half;
    return box.Intersect(ray, 1e-6, datasets::kNoHit);
  }
};

/// By ray casting: what lies in front at each pixel's centre.
Grid<Front> Truth(const datasets::Scene& scene, const KnownBox& box, const Shot& novel) {
  Grid<Front> truth(novel.camera.width_px(), novel.camera.height_px());
  const Pose world_from_cam = novel.cam_from_world.Inverse();
  for (int y = 0; y < truth.height(); ++y) {
    for (int x = 0; x < truth.width(); ++x) {
      const datasets::Ray ray{
          world_from_cam.translation,
          world_from_cam.rotation * novel.camera.RayFromPixel({x + 0.5, y + 0.5})};
      const auto hit = scene.Intersect(ray);
      const double of_scene = hit ? hit->t : datasets::kNoHit, of_box = box.Intersect(ray);
      truth(x, y) = of_box < of_scene             ? Front::kModel
                    : of_scene < datasets::kNoHit ? Front::kScene
                                                  : Front::kNothing;
    }
  }
  return truth;
}

bool NearEdge(const Grid<Front>& truth, int x, int y) {
  for (int j = -kEdgePx; j <= kEdgePx; ++j) {
    for (int i = -kEdgePx; i <= kEdgePx; ++i) {
      if (truth.Contains(x + i, y + j) && truth(x + i, y + j) != truth(x, y)) return true;
    }
  }
  return false;
}

struct Hybrid {
  datasets::Scene scene = datasets::MakeScene("courtyard", 1);
  NamedScene named = ExactScene("courtyard", 5, 360, 240);
  KnownBox box;
};

struct Score {
  int judged = 0, right = 0, model = 0;
};

/// Of the pixels away from edges, or of those among them whose ray meets the box, seen or hidden.
Score ScoreOf(const Hybrid& hybrid, const Grid<Front>& truth, const ImageRgb8& image,
              bool only_box) {
  Score score;
  const Shot& novel = hybrid.named.novel;
  const Pose world_from_cam = novel.cam_from_world.Inverse();
  for (int y = 0; y < truth.height(); ++y) {
    for (int x = 0; x < truth.width(); ++x) {
      const datasets::Ray ray{
          world_from_cam.translation,
          world_from_cam.rotation * novel.camera.RayFromPixel({x + 0.5, y + 0.5})};
      if (NearEdge(truth, x, y)) continue;
      if (only_box && !(hybrid.box.Intersect(ray) < datasets::kNoHit)) continue;
      ++score.judged;
      score.model += truth(x, y) == Front::kModel;
      score.right += IsRed(image, x, y) == (truth(x, y) == Front::kModel);
    }
  }
  return score;
}

struct Placement {
  const char* name;
  osg::Matrixd world_from_scene;
};

std::vector<Placement> Placements() {
  const osg::Matrixd turned =
      osg::Matrixd::rotate(0.7, osg::Vec3d(0.3, -0.2, 0.9)) * osg::Matrixd::translate(30, -12, 5);
  return {{"identity", osg::Matrixd()},
          {"turned and moved", turned},
          {"three times as large", osg::Matrixd::scale(3, 3, 3) * turned}};
}

class HybridTest : public OsgTest {};

TEST_F(HybridTest, ModelAndSceneHideEachOther) {
  Hybrid hybrid;
  // In the courtyard, behind some things and before others.
  const auto focus = hybrid.scene.framing().focus;
  hybrid.box = {focus + Eigen::Vector3d(0.6, 0.9, -0.1), {0.9, 0.5, 0.9}};
  const Grid<Front> truth = Truth(hybrid.scene, hybrid.box, hybrid.named.novel);
  for (const auto threading : {osgViewer::ViewerBase::SingleThreaded,
                               osgViewer::ViewerBase::CullThreadPerCameraDrawThreadPerContext}) {
    for (const Placement& placement : Placements()) {
      SCOPED_TRACE(placement.name);
      osg::ref_ptr<DepthTR> node = new DepthTR;
      node->setScene(hybrid.named.set);
      osg::ref_ptr<osg::MatrixTransform> root =
          new osg::MatrixTransform(placement.world_from_scene);
      root->addChild(node);
      root->addChild(RedBox(hybrid.box.center, hybrid.box.half));
      OffscreenViewer viewer(root.get(), hybrid.named.novel.camera, {}, threading);
      osg::Matrixd eye_from_scene = osg::Matrixd::inverse(placement.world_from_scene) *
                                    osgDTR::ViewMatrixOf(hybrid.named.novel.cam_from_world);
      // A camera in the world is as large as the world: only the node is scaled.
      const double scale =
          osg::Vec3d(placement.world_from_scene(0, 0), placement.world_from_scene(0, 1),
                     placement.world_from_scene(0, 2))
              .length();
      eye_from_scene = eye_from_scene * osg::Matrixd::scale(scale, scale, scale);
      viewer.viewer.getCamera()->setViewMatrix(eye_from_scene);
      const Shown& shown = viewer.Draw(3);
      const Score whole = ScoreOf(hybrid, truth, shown.image, false);
      const Score at_box = ScoreOf(hybrid, truth, shown.image, true);
      EXPECT_GT(at_box.model, 500);
      EXPECT_GT(at_box.judged - at_box.model, 500);  // the scene hides part of the box
      EXPECT_GE(whole.right, kRightShare * whole.judged);
      EXPECT_GE(at_box.right, kRightShare * at_box.judged);
      std::printf("%s: right on %.2f %% of %d pixels, %.2f %% of the %d that the box covers\n",
                  placement.name, 100.0 * whole.right / whole.judged, whole.judged,
                  100.0 * at_box.right / at_box.judged, at_box.judged);
      if (const char* folder = std::getenv("DTR_TEST_PICTURES")) {
        io::WriteImage(std::string(folder) + "/hybrid " + placement.name + ".png", shown.image);
      }
    }
  }
}

}  // namespace
}  // namespace dtr::testing
