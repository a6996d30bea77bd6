#include "calib/colmap/own_held_out.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/calib3d.hpp>

#include "calib/sfm/matching/match_photos.h"

namespace dtr::colmap {
namespace {

// Of a photo's long side: what a pose may miss a point by, at first and in the end.
constexpr double kCoarseShare = 12.0 / 1600, kFineShare = 4.0 / 1600;

// A feature of the photo with the point that most of its matches name.
struct Seen {
  size_t feature = 0;
  std::uint64_t point_id = 0;
  Eigen::Vector3d p_in_world;
};

std::vector<Seen> PointsSeen(const ViewToPlace& view, std::span<const SourceView> sources,
                             const sfm::ViewGraph& graph, const calib::SfmModel& model) {
  const int held = static_cast<int>(sources.size());
  std::vector<std::map<std::uint64_t, int>> votes(view.features.keypoints.size());
  for (const sfm::PairGeometry& pair : graph.pairs) {
    if (pair.image_b != held) continue;
    const auto& of_source = sources[static_cast<size_t>(pair.image_a)].image->features;
    for (const auto& [in_source, in_view] : pair.matches) {
      if (in_source >= of_source.size()) continue;
      const std::uint64_t id = of_source[in_source].point_id;
      if (model.points.contains(id)) ++votes[in_view][id];
    }
  }
  std::vector<Seen> seen;
  for (size_t f = 0; f < votes.size(); ++f) {
    if (votes[f].empty()) continue;
    const auto most = std::max_element(votes[f].begin(), votes[f].end(), [](auto& a, auto& b) {
      return a.second < b.second;  // of equals the first: the lower id
    });
    seen.push_back({f, most->first, model.points.at(most->first).p_in_world});
  }
  return seen;
}

// Points and rays as OpenCV takes them: of a camera with focal length 1, far from any distortion.
struct Correspondences {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> rays;
  std::vector<size_t> of;  // indices into the seen
};

Eigen::Vector2d PixelOf(const ViewToPlace& view, size_t feature) {
  const sfm::Keypoint& keypoint = view.features.keypoints[feature];
  return {keypoint.x_px, keypoint.y_px};
}

Correspondences Undistorted(const ViewToPlace& view, const calib::LensCamera& lens,
                            std::span<const Seen> seen, std::span<const size_t> chosen) {
  Correspondences result;
  for (const size_t i : chosen) {
    const auto ray = lens.RayFromPixel(PixelOf(view, seen[i].feature));
    if (!ray || ray->z() <= 0) continue;
    const Eigen::Vector3d& p = seen[i].p_in_world;
    result.points.emplace_back(p.x(), p.y(), p.z());
    result.rays.emplace_back(ray->x() / ray->z(), ray->y() / ray->z());
    result.of.push_back(i);
  }
  return result;
}

Pose PoseOf(const cv::Mat& rotation, const cv::Mat& translation) {
  const Eigen::Vector3d r(rotation.at<double>(0), rotation.at<double>(1), rotation.at<double>(2));
  Pose pose;
  if (r.norm() > 0) pose.rotation = Eigen::AngleAxisd(r.norm(), r.normalized());
  pose.translation = {translation.at<double>(0), translation.at<double>(1),
                      translation.at<double>(2)};
  return pose;
}

// Those of the seen that the pose puts within `limit_px` of where they are.
std::vector<size_t> Agreeing(const ViewToPlace& view, const calib::LensCamera& lens,
                             const Pose& pose, std::span<const Seen> seen, double limit_px) {
  std::vector<size_t> agree;
  for (size_t i = 0; i < seen.size(); ++i) {
    const auto pixel = lens.PixelFromCam(pose * seen[i].p_in_world);
    if (pixel && (*pixel - PixelOf(view, seen[i].feature)).norm() <= limit_px) agree.push_back(i);
  }
  return agree;
}

double SquaresPx2(const ViewToPlace& view, const calib::LensCamera& lens, const Pose& pose,
                  std::span<const Seen> seen, std::span<const size_t> of) {
  double sum = 0;
  for (const size_t i : of) {
    const auto pixel = lens.PixelFromCam(pose * seen[i].p_in_world);
    if (!pixel) return INFINITY;
    sum += (*pixel - PixelOf(view, seen[i].feature)).squaredNorm();
  }
  return sum;
}

struct Placing {
  Pose pose;
  std::vector<size_t> agree;
};

std::optional<Placing> Coarse(const ViewToPlace& view, const calib::LensCamera& lens,
                              std::span<const Seen> seen, double limit_px, int min_inliers) {
  std::vector<size_t> all(seen.size());
  for (size_t i = 0; i < all.size(); ++i) all[i] = i;
  const Correspondences known = Undistorted(view, lens, seen, all);
  if (static_cast<int>(known.of.size()) < std::max(min_inliers, 4)) return std::nullopt;
  cv::Mat rotation, translation;
  std::vector<int> inliers;
  constexpr int kTries = 2000;
  constexpr double kSure = 0.99999;
  const bool found = cv::solvePnPRansac(known.points, known.rays, cv::Matx33d::eye(), cv::noArray(),
                                        rotation, translation, false, kTries,
                                        static_cast<float>(limit_px / lens.params.front()), kSure,
                                        inliers, cv::SOLVEPNP_AP3P);
  if (!found || static_cast<int>(inliers.size()) < min_inliers) return std::nullopt;
  const Pose pose = PoseOf(rotation, translation);
  return Placing{pose, Agreeing(view, lens, pose, seen, limit_px)};
}

// Least squares over those that agree, starting at their pose.
void Settle(const ViewToPlace& view, const calib::LensCamera& lens, std::span<const Seen> seen,
            Placing& placing) {
  const Correspondences known = Undistorted(view, lens, seen, placing.agree);
  if (known.of.size() < 4) return;
  const Eigen::AngleAxisd turn(placing.pose.rotation);
  const Eigen::Vector3d r = turn.angle() * turn.axis();
  cv::Mat rotation = (cv::Mat_<double>(3, 1) << r.x(), r.y(), r.z());
  const Eigen::Vector3d& t = placing.pose.translation;
  cv::Mat translation = (cv::Mat_<double>(3, 1) << t.x(), t.y(), t.z());
  cv::solvePnPRefineLM(known.points, known.rays, cv::Matx33d::eye(), cv::noArray(), rotation,
                       translation);
  placing.pose = PoseOf(rotation, translation);
}

calib::LensCamera WithFocal(calib::LensCamera lens, double factor) {
  for (int i = 0; i < calib::FocalCount(lens.model); ++i) {
    lens.params[static_cast<size_t>(i)] *= factor;
  }
  return lens;
}

// The focal length, within half and twice the lens's, with which the points fit best: golden
// section on its logarithm, the pose settled for each.
calib::LensCamera FitFocal(const ViewToPlace& view, const calib::LensCamera& lens,
                           std::span<const Seen> seen, const Placing& placing) {
  const double golden = (std::sqrt(5.0) - 1) / 2;
  double low = -std::log(2.0), high = std::log(2.0);
  const auto cost = [&](double log_factor) {
    const calib::LensCamera tried = WithFocal(lens, std::exp(log_factor));
    Placing settled = placing;
    Settle(view, tried, seen, settled);
    return SquaresPx2(view, tried, settled.pose, seen, placing.agree);
  };
  double a = high - golden * (high - low), b = low + golden * (high - low);
  double cost_a = cost(a), cost_b = cost(b);
  constexpr double kExactEnough = 1e-4;
  while (high - low > kExactEnough) {
    if (cost_a <= cost_b) {
      high = b, b = a, cost_b = cost_a;
      a = high - golden * (high - low), cost_a = cost(a);
    } else {
      low = a, a = b, cost_a = cost_b;
      b = low + golden * (high - low), cost_b = cost(b);
    }
  }
  return WithFocal(lens, std::exp((low + high) / 2));
}

sfm::ViewGraph MatchWith(const ViewToPlace& view, std::span<const SourceView> sources,
                         std::uint64_t seed, Progress& progress) {
  std::vector<sfm::MatchPhoto> photos;
  std::vector<calib::LensCamera> lenses;
  std::vector<bool> lens_is_known, focal_is_known;
  std::vector<std::pair<int, int>> pairs;
  const int held = static_cast<int>(sources.size());
  for (int i = 0; i < held; ++i) {
    const SourceView& source = sources[static_cast<size_t>(i)];
    photos.push_back(
        {source.image->name, source.lens->width_px, source.lens->height_px, i, source.features});
    lenses.push_back(*source.lens);
    lens_is_known.push_back(true);
    pairs.emplace_back(i, held);
  }
  photos.push_back(
      {"held-out photo", view.lens.width_px, view.lens.height_px, held, view.features});
  lenses.push_back(view.lens);
  focal_is_known = lens_is_known;
  lens_is_known.push_back(view.lens_is_known);
  focal_is_known.push_back(view.lens_is_known || view.focal_is_known);
  return sfm::MatchPhotos(photos, lenses, focal_is_known,
                          {.threads = 1,
                           .seed = seed,
                           .lens_is_known = lens_is_known,
                           .pairs = pairs,
                           .progress = &progress})
      .graph;
}

}  // namespace

std::optional<PlacedView> PlaceView(const ViewToPlace& view, std::span<const SourceView> sources,
                                    const calib::SfmModel& model, int min_inliers,
                                    std::uint64_t seed, Progress& progress) {
  const sfm::ViewGraph graph = MatchWith(view, sources, seed, progress);
  calib::LensCamera lens = view.lens_is_known ? view.lens : graph.cameras.back();
  const std::vector<Seen> seen = PointsSeen(view, sources, graph, model);
  const double side_px = std::max(lens.width_px, lens.height_px);
  auto placing = Coarse(view, lens, seen, kCoarseShare * side_px, min_inliers);
  if (!placing) return std::nullopt;
  if (!view.lens_is_known) lens = FitFocal(view, lens, seen, *placing);
  Settle(view, lens, seen, *placing);
  constexpr int kPasses = 3;
  for (int pass = 0; pass < kPasses; ++pass) {
    placing->agree = Agreeing(view, lens, placing->pose, seen, kFineShare * side_px);
    Settle(view, lens, seen, *placing);
  }
  placing->agree = Agreeing(view, lens, placing->pose, seen, kFineShare * side_px);
  if (static_cast<int>(placing->agree.size()) < min_inliers) return std::nullopt;
  PlacedView placed{{}, lens};
  placed.image.cam_from_world = placing->pose;
  for (size_t f = 0; f < view.features.keypoints.size(); ++f) {
    placed.image.features.push_back({PixelOf(view, f), calib::SfmFeature::kNoPoint});
  }
  for (const size_t i : placing->agree) {
    placed.image.features[seen[i].feature].point_id = seen[i].point_id;
  }
  return placed;
}

}  // namespace dtr::colmap
