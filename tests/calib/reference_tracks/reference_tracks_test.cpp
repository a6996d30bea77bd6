// The reference tracks that calibrations are compared by: residuals of cameras whose errors are
// known, and observations in rendered photos whose cameras are known.
#include <gtest/gtest.h>

#include <cmath>

#include "calib/bundle/held_out.h"
#include "calib/reference_tracks/score.h"
#include "datasets/make.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/image_io.h"
#include "tests/calib/bundle/synthetic_bundle.h"
#include "tests/support/on_threads.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

using calib::ReferenceTracksScore;
using calib::ScoreCameras;
using calib::SfmModel;
using calib::Track;

constexpr double kScalePx = 2;

std::vector<Track> TracksOf(const calib::Bundle& bundle) {
  std::vector<Track> tracks(bundle.points.size());
  for (const calib::BundleObservation& o : bundle.observations) {
    tracks[static_cast<size_t>(o.point)].push_back({o.image, o.pixel});
  }
  std::erase_if(tracks, [](const Track& track) { return track.size() < calib::kMinTrackLength; });
  return tracks;
}

/// True cameras and what they see, with noise.
struct Scene {
  explicit Scene(double noise_px) : bundle(MakeBundle({.noise_px = noise_px})) {}
  calib::Bundle bundle;
  SfmModel model = ModelFrom(bundle);
  std::vector<Track> tracks = TracksOf(bundle);
  std::vector<std::string> photos = calib::ImageNames(model);
  ReferenceTracksScore Score(const SfmModel& cameras, int threads = 1) const {
    return OnThreads(threads, [&] { return ScoreCameras(cameras, photos, tracks, kScalePx); });
  }
};

void Turn(calib::SfmImage& image, double angle_rad) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitY()));
  image.cam_from_world = Pose{turn, Eigen::Vector3d::Zero()} * image.cam_from_world;
}

TEST(ScoreCameras, TrueCamerasMissExactObservationsByRoundingOnly) {
  constexpr double kRoundingPx = 1e-5;  // the triangulation stops when it moves by 1e-9 px
  const Scene scene(0);
  const ReferenceTracksScore score = scene.Score(scene.model);
  ASSERT_GT(score.observations, 500);
  EXPECT_EQ(score.predicted, score.observations);
  EXPECT_LT(score.error_px, kRoundingPx);
}

TEST(ScoreCameras, TrueCamerasMissNoisyObservationsByTheNoise) {
  // Two coordinates of the observation itself, and what the others' noise does to the point: with n
  // others 2 * sigma^2 * (1 + about 1/n to 2/n); the loss, of 20 scales, takes off less than a
  // hundredth.
  constexpr double kNoisePx = 0.1;
  const Scene scene(kNoisePx);
  const double least = kNoisePx * std::sqrt(2.0);
  const ReferenceTracksScore score = scene.Score(scene.model);
  EXPECT_GT(score.error_px, least);
  EXPECT_LT(score.error_px, 1.4 * least);
  EXPECT_GT(score.median_px, 0.8 * least);
  const ReferenceTracksScore again = scene.Score(scene.model, 3);
  EXPECT_EQ(again.error_px, score.error_px) << "by the number of threads";
}

TEST(ScoreCameras, TheErrorGrowsWithThatOfTheCameras) {
  const Scene scene(0.1);
  double last = scene.Score(scene.model).error_px;
  for (const double shift_px : {0.5, 1.0, 2.0}) {
    SfmModel turned = scene.model;
    const double focal_px = turned.cameras.begin()->second.params[0];
    for (size_t i = 0; i < turned.images.size(); i += 3) {
      Turn(turned.images[i], shift_px / focal_px);
    }
    const ReferenceTracksScore score = scene.Score(turned);
    EXPECT_GT(score.error_px, last + 0.1 * shift_px) << shift_px;
    EXPECT_LT(score.error_px, 2 * shift_px) << "no more than cameras were turned, twice over";
    last = score.error_px;
  }
  SfmModel other_lens = scene.model;
  other_lens.cameras.begin()->second.params[3] += 0.06;  // k1
  EXPECT_GT(scene.Score(other_lens).error_px, 2 * scene.Score(scene.model).error_px);
}

TEST(ScoreCameras, APhotoWithoutACameraIsNoAdvantage) {
  const Scene scene(0.1);
  SfmModel fewer = scene.model;
  fewer.images.erase(fewer.images.begin() + 2);
  size_t lost = 0, all = 0;
  for (const Track& track : scene.tracks) {
    all += track.size();
    for (const calib::PhotoObservation& observation : track) lost += observation.photo == 2;
  }
  const ReferenceTracksScore whole = scene.Score(scene.model), score = scene.Score(fewer);
  EXPECT_EQ(score.observations, whole.observations);
  EXPECT_EQ(score.observations - score.predicted, static_cast<int>(lost));
  // By hand: each counts as missed by 10 scales.
  const double far_off = 100 * kScalePx * kScalePx;
  EXPECT_GT(score.error_px,
            std::sqrt(far_off * static_cast<double>(lost) / static_cast<double>(all)));
  EXPECT_GT(score.error_px, 5 * whole.error_px);
  // And none at all, or photos of other names, predict nothing.
  EXPECT_EQ(scene.Score({}).predicted, 0);
  EXPECT_NEAR(scene.Score({}).error_px, std::sqrt(far_off), 1e-9);
}

/// Photos of the courtyard, and the cameras that took them.
class RenderedReferenceTracks : public ::testing::Test {
 protected:
  static constexpr int kPhotos = 6;
  void SetUp() override {
    datasets::DatasetSpec spec;
    spec.layout = "arc";
    spec.views = kPhotos;
    spec.width_px = 480;
    spec.height_px = 320;
    SilentProgress silent;
    datasets::MakeDataset(spec, folder_ / "made", silent);
    const io::CameraList list = io::ReadCamerasJson(folder_ / "made/cameras.json");
    for (const io::NamedCamera& named : list.cameras) {
      const PinholeCamera& c = named.camera;
      const auto id = static_cast<std::uint32_t>(model_.images.size() + 1);
      model_.cameras[id] = {calib::CameraModel::kPinhole,
                            c.width_px(),
                            c.height_px(),
                            {c.fx_px(), c.fy_px(), c.cx_px(), c.cy_px()}};
      model_.images.push_back({id, named.name, id, named.cam_from_world, {}});
    }
  }
  std::vector<Track> Find(int threads, const Mask& mask = {}) const {
    SilentProgress silent;
    return OnThreads(threads, [&] {
      return calib::FindTracks(
          kPhotos,
          [&](int i) {
            const std::string& name = model_.images[static_cast<size_t>(i)].name;
            return calib::ReferenceTracksPhoto{io::ReadImage(folder_ / "made/images" / name), mask};
          },
          silent);
    });
  }
  ReferenceTracksScore Score(const SfmModel& model, const std::vector<Track>& tracks) const {
    return ScoreCameras(model, calib::ImageNames(model_), tracks, 1);
  }

  TemporaryFolder folder_;
  SfmModel model_;
};

TEST_F(RenderedReferenceTracks, TheTrueCamerasAreTheBest) {
  const std::vector<Track> tracks = Find(2);
  ASSERT_GE(tracks.size(), static_cast<size_t>(calib::kMinHeldOut));
  const ReferenceTracksScore truth = Score(model_, tracks);
  EXPECT_EQ(truth.predicted, truth.observations);
  EXPECT_LT(truth.median_px, 0.5) << "a slip of half a pixel, or wrong matches";
  for (const double shift_px : {-1.0, 1.0}) {
    SfmModel turned = model_;
    Turn(turned.images[2], shift_px / turned.cameras.at(3).params[0]);
    EXPECT_GT(Score(turned, tracks).error_px, 1.05 * truth.error_px) << shift_px;
    SfmModel longer = model_;
    for (auto& [id, camera] : longer.cameras) {
      camera.params[0] *= 1 + 0.03 * shift_px;
      camera.params[1] *= 1 + 0.03 * shift_px;
    }
    EXPECT_GT(Score(longer, tracks).error_px, 1.05 * truth.error_px) << shift_px;
  }
}

TEST_F(RenderedReferenceTracks, IsTheSameForAnyNumberOfThreadsAndHeedsMasks) {
  const std::vector<Track> one = Find(1), three = Find(3);
  ASSERT_EQ(one.size(), three.size());
  for (size_t t = 0; t < one.size(); ++t) {
    ASSERT_EQ(one[t].size(), three[t].size());
    for (size_t i = 0; i < one[t].size(); ++i) {
      EXPECT_EQ(one[t][i].photo, three[t][i].photo);
      EXPECT_EQ(one[t][i].pixel, three[t][i].pixel);
      EXPECT_TRUE(i == 0 || one[t][i - 1].photo < one[t][i].photo);
    }
  }
  Mask left(480, 320, 1, 0);
  for (int y = 0; y < 320; ++y) std::fill_n(left.row(y), 240, std::uint8_t{255});
  for (const Track& track : Find(2, left)) {
    for (const calib::PhotoObservation& observation : track) EXPECT_LE(observation.pixel.x(), 241);
  }
}

}  // namespace
}  // namespace dtr::testing
