// calib/triangulate.h -- a point from the rays that saw it.
#pragma once
#include <Eigen/Core>
#include <span>

#include "dtr/types/camera.h"
#include "dtr/types/pose.h"

namespace dtr::calib {

/// One observation of a point: a camera with its centre and rotation in the world, and the pixel.
struct Observation {
  const PinholeCamera* camera = nullptr;
  Eigen::Matrix3d cam_from_world_rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d center = Eigen::Vector3d::Zero();      ///< in world
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< unit length, in world
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

/// Builds an observation with its ray.
Observation MakeObservation(const PinholeCamera& camera, const Pose& cam_from_world,
                            const Eigen::Vector2d& pixel);

/// How a triangulation ended.
enum class TriangulationStatus {
  kConverged,
  kDegenerate,  ///< the rays do not fix a point: too parallel, or fewer than two
  kBehind,      ///< the best point lies behind a camera that saw it, or none was found
};

struct Triangulation {
  TriangulationStatus status = TriangulationStatus::kDegenerate;
  Eigen::Vector3d p_in_world = Eigen::Vector3d::Zero();
  /// Inverse of the Gauss-Newton matrix in px^-2 * length^2: covariance for observation noise of
  /// 1 px per axis.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

/// Point seen by all of `observations` but number `left_out` (-1: none). Starts at the point
/// nearest to all rays (linear least squares), then Gauss-Newton with Levenberg's damping on
/// reprojection error under Huber's loss, so that one wrong observation among many does not carry
/// the point away. Coordinates are taken relative to the cameras and steps are relative to the
/// matrix itself, so neither the world's origin nor its scale matters.
Triangulation Triangulate(std::span<const Observation> observations, int left_out);

/// Pixel residual (observed minus predicted) of a point, and its derivative with respect to the
/// point. False when the point is not in front of the camera.
bool PixelResidual(const Observation& observation, const Eigen::Vector3d& p_in_world,
                   Eigen::Vector2d* residual, Eigen::Matrix<double, 2, 3>* pixel_by_point);

}  // namespace dtr::calib
