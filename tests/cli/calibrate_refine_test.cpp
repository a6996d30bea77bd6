// `dtr calibrate refine` on models that cannot be refined: the reason by name and exit code 1.
#include <gtest/gtest.h>

#include "calib/colmap/model_io.h"
#include "tests/calib/bundle/synthetic_bundle.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

const calib::LensCamera kLens{calib::LensModel::kPinhole, 1000, 800, {900, 905, 504, 397}};

TEST(CalibrateRefine, DegenerateModelsAreRefusedByName) {
  const TemporaryFolder folder;
  const auto refine = [&](const std::string& name, const bundle::SceneSpec& spec) {
    const std::string model = (folder / name).string();
    colmap::WriteModel(model, ModelFrom(bundle::MakeBundle(spec)), colmap::Format::kBinary);
    return Dtr({"calibrate", "refine", model, "-o", model + "-out"});
  };
  bundle::SceneSpec spec{.images = 6, .points = 300, .lens = kLens, .noise_px = 0.3};
  EXPECT_EQ(refine("good", spec).code, 0);
  spec.pose = [](int i, int) {
    return bundle::LookAt({0, -6, 1}, {0.4 * i - 1, 0, 0.2 * (i % 3)});
  };
  ExpectRefused(refine("turning", spec), kFailed,
                ": pure_rotation: half the points have a parallax");
  EXPECT_EQ(FilesIn(folder / "turning-out"), 0) << "nothing that means nothing is left";
  spec.pose = [](int i, int) {  // a wall faced squarely: focal length and distance are one
    const Eigen::Vector3d centre(0.5 * (i % 3) - 0.5, -6, 0.5 * (i / 3));
    return bundle::LookAt(centre, centre + Eigen::Vector3d::UnitY());
  };
  spec.point = [](Random& random) {
    const double x = random.Uniform(-2, 2);
    return Eigen::Vector3d(x, 0, random.Uniform(-1.5, 1.5));
  };
  ExpectRefused(refine("wall", spec), kFailed, ": planar_scene: the points lie in a plane");
}

}  // namespace
}  // namespace dtr::testing
