// calib/sfm/mapping/points.h -- internal to calib/sfm/mapping: points of tracks, cameras given.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "calib/bundle/bundle.h"
#include "calib/sfm/mapping/pair_poses.h"
#include "calib/sfm/mapping/tracks.h"
#include "dtr/types/pose.h"

namespace dtr::sfm {

/// Cameras of a map in the making.
struct MapCameras {
  std::vector<calib::LensCamera> lenses;  ///< per camera of the graph
  std::vector<char> placed;               ///< per image
  std::vector<Pose> cam_from_world;       ///< per image; of unplaced ones meaningless
  Rays rays;                              ///< through `lenses`
};

/// A point and the features of its track that agree with it.
struct MapPoint {
  Eigen::Vector3d p_in_world = Eigen::Vector3d::Zero();
  int track = 0;
  Track seen;
};

struct PointOptions {
  /// Largest reprojection error, px of an image of 1000 px; longer sides grow it.
  double max_error = 4;
  double min_angle_rad = 0.026;  ///< between the two rays that lie widest apart (1.5 degrees)
};

/// The limit in px for an image: of a photo with more pixels features err by more of them.
double LimitPx(double per_1000_px, const calib::LensCamera& lens);

/// Reprojection error in px; infinite where the point has no pixel.
double ReprojectionErrorPx(const ViewGraph& graph, const MapCameras& cameras,
                           const TrackFeature& feature, const Eigen::Vector3d& p_in_world);

/// Points of the tracks of `chosen`, by features of placed images that agree: the point nearest to
/// all rays, or, where some disagree, to those of the two rays that most others agree with. Tracks
/// without two agreeing features or with too small an angle have none. In the order of `chosen`.
std::vector<MapPoint> PointsOf(const ViewGraph& graph, const MapCameras& cameras,
                               std::span<const Track> tracks, std::span<const int> chosen,
                               const PointOptions& options);

/// Takes away features that exceed the options' error, then points with fewer than two or too small
/// an angle.
void FilterPoints(const ViewGraph& graph, const MapCameras& cameras, const PointOptions& options,
                  std::vector<MapPoint>* points);

/// Takes away what stands out among its image's own errors: features beyond 4.25 times their median
/// (5 standard deviations), and beyond 1 px of an image of 1000 px, then points with fewer than
/// two. Of an image that stands wrong, whose errors are large as a whole, they stay.
void DropOutliers(const ViewGraph& graph, const MapCameras& cameras, std::vector<MapPoint>* points);

/// Largest angle in rad between the rays from the cameras of `seen` to a point.
double LargestAngle(const MapCameras& cameras, const Track& seen,
                    const Eigen::Vector3d& p_in_world);

/// Bundle of the placed images (their indices in `image_of`) and back.
calib::Bundle BundleOfMap(const ViewGraph& graph, const MapCameras& cameras,
                          std::span<const MapPoint> points, std::vector<int>* image_of);
void TakeFromBundle(const calib::Bundle& bundle, std::span<const int> image_of, MapCameras* cameras,
                    std::vector<MapPoint>* points);

/// Per image, of how many points it has a feature.
std::vector<int> PointCounts(size_t images, std::span<const MapPoint> points);

}  // namespace dtr::sfm
