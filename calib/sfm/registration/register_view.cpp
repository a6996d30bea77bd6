#include "calib/sfm/registration/register_view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "calib/sfm/matching/match_photos.h"
#include "calib/sfm/registration/absolute_pose.h"

namespace dtr::sfm {
namespace {

// Of a photo's long side: what a pose may miss a point by, at first and in the end.
constexpr double kCoarseShare = 12.0 / 1600, kFineShare = 4.0 / 1600;

// A feature of the photo with the point that most of its matches name.
struct Observation {
  size_t feature = 0;
  std::uint64_t point_id = 0;
  Eigen::Vector3d p_in_world;
};

std::vector<Observation> ObservationsOf(const UnregisteredView& view,
                                        std::span<const SourceView> sources, const ViewGraph& graph,
                                        const calib::SfmModel& model) {
  const int this_view = static_cast<int>(sources.size());
  std::vector<std::map<std::uint64_t, int>> votes(view.features.keypoints.size());
  for (const PairGeometry& pair : graph.pairs) {
    if (pair.image_b != this_view) continue;
    const auto& of_source = sources[static_cast<size_t>(pair.image_a)].image->features;
    for (const auto& [in_source, in_view] : pair.matches) {
      if (in_source >= of_source.size()) continue;
      const std::uint64_t id = of_source[in_source].point_id;
      if (model.points.contains(id)) ++votes[in_view][id];
    }
  }
  std::vector<Observation> observations;
  for (size_t f = 0; f < votes.size(); ++f) {
    if (votes[f].empty()) continue;
    const auto winner = std::max_element(votes[f].begin(), votes[f].end(), [](auto& a, auto& b) {
      return a.second < b.second;  // of equals the first: the lower id
    });
    observations.push_back({f, winner->first, model.points.at(winner->first).p_in_world});
  }
  return observations;
}

// The search for a pose of one photo through one camera.
class Registration {
 public:
  Registration(const UnregisteredView& view, const calib::LensCamera& camera,
               std::span<const Observation> observations)
      : view_(view), camera_(camera), observations_(observations) {}

  // By RANSAC; empty where fewer than `min_inliers` agree.
  bool Find(double limit_px, int min_inliers) {
    std::vector<size_t> all(observations_.size());
    for (size_t i = 0; i < all.size(); ++i) all[i] = i;
    const auto found =
        FindPose(RaysOf(all), limit_px / camera_.params.front(), std::max(min_inliers, 4));
    if (!found) return false;
    pose_ = found->cam_from_world;
    inliers_ = Within(limit_px);
    return true;
  }

  void Refine() {
    if (const auto refined = RefineAbsolutePose(RaysOf(inliers_), pose_)) pose_ = *refined;
  }

  void TakeWithin(double limit_px) { inliers_ = Within(limit_px); }

  // The focal length, within half and twice the camera's, with which the points fit best: golden
  // section on its logarithm, the pose refined for each.
  void FitFocal() {
    const double golden = (std::sqrt(5.0) - 1) / 2;
    double low = -std::log(2.0), high = std::log(2.0);
    const auto cost = [&](double log_factor) {
      Registration tried = *this;
      tried.camera_ = WithFocal(std::exp(log_factor));
      tried.Refine();
      return tried.SquaresPx2();
    };
    double a = high - golden * (high - low), b = low + golden * (high - low);
    double cost_a = cost(a), cost_b = cost(b);
    constexpr double kTolerance = 1e-4;
    while (high - low > kTolerance) {
      if (cost_a <= cost_b) {
        high = b, b = a, cost_b = cost_a;
        a = high - golden * (high - low), cost_a = cost(a);
      } else {
        low = a, a = b, cost_a = cost_b;
        b = low + golden * (high - low), cost_b = cost(b);
      }
    }
    camera_ = WithFocal(std::exp((low + high) / 2));
  }

  const Pose& pose() const { return pose_; }
  const calib::LensCamera& camera() const { return camera_; }
  const std::vector<size_t>& inliers() const { return inliers_; }

 private:
  Eigen::Vector2d PixelOf(size_t observation) const {
    const Keypoint& keypoint = view_.features.keypoints[observations_[observation].feature];
    return {keypoint.x_px, keypoint.y_px};
  }

  PointRays RaysOf(std::span<const size_t> chosen) const {
    PointRays seen;
    for (const size_t i : chosen) {
      const auto ray = camera_.RayFromPixel(PixelOf(i));
      if (ray && ray->z() > 0) seen.Add(observations_[i].p_in_world, ray->hnormalized());
    }
    return seen;
  }

  // Squared reprojection error; infinite where the point has no pixel.
  double ErrorPx2(size_t i) const {
    const auto pixel = camera_.PixelFromCam(pose_ * observations_[i].p_in_world);
    return pixel ? (*pixel - PixelOf(i)).squaredNorm() : std::numeric_limits<double>::infinity();
  }

  std::vector<size_t> Within(double limit_px) const {
    std::vector<size_t> agree;
    for (size_t i = 0; i < observations_.size(); ++i) {
      if (ErrorPx2(i) <= limit_px * limit_px) agree.push_back(i);
    }
    return agree;
  }

  double SquaresPx2() const {
    double sum = 0;
    for (const size_t i : inliers_) sum += ErrorPx2(i);
    return sum;
  }

  calib::LensCamera WithFocal(double factor) const {
    calib::LensCamera camera = camera_;
    for (int i = 0; i < calib::FocalCount(camera.model); ++i) {
      camera.params[static_cast<size_t>(i)] *= factor;
    }
    return camera;
  }

  const UnregisteredView& view_;
  calib::LensCamera camera_;
  std::span<const Observation> observations_;
  Pose pose_;
  std::vector<size_t> inliers_;
};

ViewGraph MatchWith(const UnregisteredView& view, std::span<const SourceView> sources,
                    std::uint64_t seed, Progress& progress) {
  std::vector<MatchPhoto> photos;
  std::vector<calib::LensCamera> cameras;
  std::vector<std::pair<int, int>> pairs;
  const int this_view = static_cast<int>(sources.size());
  for (int i = 0; i < this_view; ++i) {
    const SourceView& source = sources[static_cast<size_t>(i)];
    photos.push_back({source.image->name, source.camera->width_px, source.camera->height_px, i,
                      source.features});
    cameras.push_back(*source.camera);
    pairs.emplace_back(i, this_view);
  }
  photos.push_back(
      {"held-out photo", view.camera.width_px, view.camera.height_px, this_view, view.features});
  cameras.push_back(view.camera);
  std::vector<bool> camera_is_known(sources.size(), true), focal_is_known(sources.size(), true);
  camera_is_known.push_back(view.camera_is_known);
  focal_is_known.push_back(view.camera_is_known || view.focal_is_known);
  return MatchPhotos(photos, cameras, focal_is_known,
                     {.seed = seed,
                      .lens_is_known = camera_is_known,
                      .pairs = pairs,
                      .progress = &progress})
      .graph;
}

}  // namespace

std::optional<RegisteredView> RegisterView(const UnregisteredView& view,
                                           std::span<const SourceView> sources,
                                           const calib::SfmModel& model, int min_inliers,
                                           std::uint64_t seed, Progress& progress) {
  const ViewGraph graph = MatchWith(view, sources, seed, progress);
  const auto observations = ObservationsOf(view, sources, graph, model);
  Registration registration(view, view.camera_is_known ? view.camera : graph.cameras.back(),
                            observations);
  const double side_px = std::max(view.camera.width_px, view.camera.height_px);
  if (!registration.Find(kCoarseShare * side_px, min_inliers)) return std::nullopt;
  if (!view.camera_is_known) registration.FitFocal();
  registration.Refine();
  constexpr int kPasses = 3;
  for (int pass = 0; pass < kPasses; ++pass) {
    registration.TakeWithin(kFineShare * side_px);
    registration.Refine();
  }
  registration.TakeWithin(kFineShare * side_px);
  if (static_cast<int>(registration.inliers().size()) < min_inliers) return std::nullopt;
  RegisteredView registered;
  registered.camera = registration.camera();
  registered.image.cam_from_world = registration.pose();
  for (const Keypoint& keypoint : view.features.keypoints) {
    registered.image.features.push_back(
        {{keypoint.x_px, keypoint.y_px}, calib::SfmFeature::kNoPoint});
  }
  for (const size_t i : registration.inliers()) {
    registered.image.features[observations[i].feature].point_id = observations[i].point_id;
  }
  return registered;
}

}  // namespace dtr::sfm
