// Cameras of fisheye photos from the photos alone, where the user says that they are: against the
// exact truth.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "calib/similarity.h"
#include "calib/sparse_from_sfm.h"
#include "capture/ingest.h"
#include "dtr/io/formats/cameras_json.h"
#include "pipeline/core/calibrate.h"
#include "tests/pipeline/dataset_once.h"

namespace dtr::pipeline {
namespace {

// Photos of a fisheye of 173 degrees across, with a lens that is not quite equidistant.
class Fisheye : public dtr::testing::DatasetOnce {
 protected:
  static constexpr double kK1 = -0.03, kK2 = 0.004;

  static void SetUpTestSuite() {
    datasets::DatasetSpec spec = Scene("courtyard", 12, 640);
    spec.height_px = 480;
    spec.focal_35mm = 12;
    spec.fisheye = true;
    spec.k1 = kK1;
    spec.k2 = kK2;
    Make(spec, "yard");
  }
  // Without EXIF only the photos tell the focal length.
  static CalibratedPhotos Calibrated(const std::string& lens_model, bool exif) {
    SilentProgress silent;
    auto photos = capture::IngestPhotos(*folder_ / "yard/images", {}, silent);
    for (capture::Photo& photo : photos.photos) {
      EXPECT_TRUE(photo.focal_prior_px);
      if (!exif) photo.focal_prior_px.reset();
    }
    CalibrateOptions options;
    options.sfm.engine = sfm::SfmEngine::kGlobal;
    options.sfm.lens_model = lens_model;
    return CalibratePhotos(photos, options, *folder_ / (lens_model + (exif ? "" : "_alone")),
                           silent);
  }
};

TEST_F(Fisheye, CamerasOfThePhotosAloneAreThoseOfTheTruth) {
  const io::CameraList truth = io::ReadCamerasJson(*folder_ / "yard/cameras.json");
  for (const auto& [model, exif] : {std::pair{"RADIAL_FISHEYE", false}, {"OPENCV_FISHEYE", true}}) {
    SCOPED_TRACE(model);
    const calib::SfmModel found = Calibrated(model, exif).model;
    ASSERT_EQ(found.images.size(), truth.cameras.size());
    const calib::LensCamera& lens = found.cameras.at(found.images.front().camera_id);
    EXPECT_EQ(calib::NameOf(lens.model), model);
    // Where the true lens draws directions up to 70 degrees off its axis, and where this one does.
    const PinholeCamera& pinhole = truth.cameras.front().camera;
    const calib::LensCamera exact{calib::CameraModel::kRadialFisheye,
                                  pinhole.width_px(),
                                  pinhole.height_px(),
                                  {pinhole.fx_px(), pinhole.cx_px(), pinhole.cy_px(), kK1, kK2}};
    for (const double degrees : {10.0, 30.0, 50.0, 70.0}) {
      const double angle = degrees * std::numbers::pi / 180;
      const Eigen::Vector3d ray(std::sin(angle), 0, std::cos(angle));
      EXPECT_NEAR(lens.PixelFromCam(ray)->x() - lens.Pinhole().cx_px(),
                  exact.PixelFromCam(ray)->x() - pinhole.cx_px(), 1.5)
          << degrees;
    }
    std::vector<std::string> names;
    for (const calib::SfmImage& image : found.images) names.push_back(image.name);
    const PinholeCamera view = lens.Pinhole();
    const SparseScene seen =
        calib::ToSparseScene(found, names, std::vector<PinholeCamera>(names.size(), view));
    EXPECT_GT(seen.observations.size(), 500u);
    for (const SparseObservation& o : seen.observations) {
      EXPECT_TRUE(o.pixel.x() >= 0 && o.pixel.x() <= view.width_px() && o.pixel.y() >= 0 &&
                  o.pixel.y() <= view.height_px());
    }
    std::vector<Eigen::Vector3d> centres, exact_centres;
    double extent = 0;
    for (size_t i = 0; i < truth.cameras.size(); ++i) {
      centres.push_back(found.images[i].cam_from_world.Inverse().translation);
      exact_centres.push_back(truth.cameras[i].cam_from_world.Inverse().translation);
      extent = std::max(extent, (exact_centres[i] - exact_centres[0]).norm());
    }
    const calib::Similarity aligned = calib::AlignPoints(centres, exact_centres);
    EXPECT_LT(calib::AlignmentRms(aligned, centres, exact_centres), 0.005 * extent);
  }
}

TEST_F(Fisheye, TakenForAPerspectiveCameraItIsDoubtedWithWhatToDo) {
  const CalibratedPhotos doubted = Calibrated("RADIAL", true);
  ASSERT_TRUE(doubted.report.sfm);
  EXPECT_THAT(doubted.report.sfm->doubt,
              ::testing::HasSubstr("a fisheye? then `lens_model` RADIAL_FISHEYE"));
}

}  // namespace
}  // namespace dtr::pipeline
