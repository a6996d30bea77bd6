#include "calib/reference_tracks/score.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "calib/bundle/held_out.h"
#include "calib/triangulate.h"
#include "dtr/base/order_statistics.h"
#include "dtr/base/parallel_for.h"

namespace dtr::calib {
namespace {

/// A photo's camera, and the pinhole camera that its undistorted pixels belong to.
struct PhotoCamera {
  LensCamera lens;
  PinholeCamera pinhole;
  Pose cam_from_world;
};

/// By the photos' numbers.
std::map<int, PhotoCamera> CamerasOf(const SfmModel& model, std::span<const std::string> photos) {
  std::map<int, PhotoCamera> cameras;
  for (const SfmImage& image : model.images) {
    const auto at = std::find(photos.begin(), photos.end(), image.name);
    if (at == photos.end()) continue;
    const LensCamera& lens = model.cameras.at(image.camera_id);
    cameras.emplace(static_cast<int>(at - photos.begin()),
                    PhotoCamera{lens, lens.Pinhole(), image.cam_from_world});
  }
  return cameras;
}

const Eigen::Vector2d kNotPredicted =
    Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());

/// Residual of each observation of a track, NaN where it is not predicted.
std::vector<Eigen::Vector2d> ResidualsOf(const Track& track,
                                         const std::map<int, PhotoCamera>& cameras) {
  std::vector<Eigen::Vector2d> residuals(track.size(), kNotPredicted);
  std::vector<Observation> observations;
  std::vector<size_t> at;  // in the track
  for (size_t i = 0; i < track.size(); ++i) {
    const auto camera = cameras.find(track[i].photo);
    if (camera == cameras.end()) continue;
    const auto ray = camera->second.lens.RayFromPixel(track[i].pixel);
    const auto pixel = ray ? camera->second.pinhole.PixelFromCam(*ray) : std::nullopt;
    if (!pixel) continue;
    observations.push_back(
        MakeObservation(camera->second.pinhole, camera->second.cam_from_world, *pixel));
    at.push_back(i);
  }
  if (observations.size() < 3) return residuals;  // one is held out, two place the point
  for (size_t k = 0; k < observations.size(); ++k) {
    const Triangulation point = Triangulate(observations, static_cast<int>(k));
    if (point.status != TriangulationStatus::kConverged) continue;
    const PhotoObservation& seen = track[at[k]];
    const PhotoCamera& camera = cameras.at(seen.photo);
    const auto pixel = camera.lens.PixelFromCam(camera.cam_from_world * point.p_in_world);
    if (pixel) residuals[at[k]] = *pixel - seen.pixel;
  }
  return residuals;
}

}  // namespace

ReferenceTracksScore ScoreCameras(const SfmModel& model, std::span<const std::string> photos,
                                  std::span<const Track> tracks, double loss_scale_px) {
  const std::map<int, PhotoCamera> cameras = CamerasOf(model, photos);
  std::vector<std::vector<Eigen::Vector2d>> residuals(tracks.size());
  ParallelFor(0, static_cast<int>(tracks.size()), [&](int i) {
    const auto t = static_cast<size_t>(i);
    residuals[t] = ResidualsOf(tracks[t], cameras);
  });
  ReferenceTracksScore score;
  const double missed_px = kMissedScales * loss_scale_px;
  std::vector<double> losses, lengths;
  for (const auto& of_track : residuals) {
    for (const Eigen::Vector2d& residual : of_track) {
      const bool predicted = residual.allFinite();
      losses.push_back(predicted ? CauchyLoss(residual, loss_scale_px) : missed_px * missed_px);
      if (predicted) lengths.push_back(residual.norm());
    }
  }
  score.observations = static_cast<int>(losses.size());
  score.predicted = static_cast<int>(lengths.size());
  if (!losses.empty()) score.error_px = std::sqrt(Mean(losses));
  if (!lengths.empty()) score.median_px = UpperMedian(lengths);
  return score;
}

}  // namespace dtr::calib
