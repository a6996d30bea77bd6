#include "calib/validation/projection.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/distributions.h"
#include "calib/lens_map.h"
#include "calib/models/board_model.h"
#include "dtr/base/order_statistics.h"

namespace dtr::calib {
namespace {

// Of what a pixel does not tell: worse than any number.
constexpr double kNoBound = std::numeric_limits<double>::infinity();

Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// d p by a motion (w, v / distance) of the frame: w x p + v.
Eigen::Matrix<double, 3, 6> ByFrame(const Eigen::Vector3d& p, double distance) {
  Eigen::Matrix<double, 3, 6> by_frame;
  by_frame << -CrossMatrix(p), distance * Eigen::Matrix3d::Identity();
  return by_frame;
}

template <typename Wanted>
std::vector<double> Only(const std::vector<double>& values, const Wanted& wanted) {
  std::vector<double> some;
  std::copy_if(values.begin(), values.end(), std::back_inserter(some), wanted);
  return some;
}

template <typename Value>
ImageMap Mapped(const RigSolution& solution, const ProjectionSensitivity& sensitivity,
                size_t camera, double distance, const Value& value) {
  const LensCamera& lens = solution.rig.cameras[camera].camera;
  ImageMap map = EmptyMap(lens);
  for (int row = 0; row < map.rows; ++row) {
    for (int column = 0; column < map.columns; ++column) {
      const Eigen::Vector2d pixel = CellCentre(map, lens, column, row);
      const auto by_shared = sensitivity.At(camera, pixel, distance);
      if (!by_shared && !IsAskedFor(lens, pixel)) continue;
      const double v = by_shared ? value(*by_shared) : kNoBound;
      map.values[static_cast<size_t>(row * map.columns + column)] = std::isnan(v) ? kNoBound : v;
    }
  }
  return map;
}

}  // namespace

ProjectionSensitivity::ProjectionSensitivity(const RigSolution& solution) : solution_(solution) {
  const long shared = solution.layout.size();
  distance_ = 0;
  for (const FrameRows& frame : solution.rows) {
    distance_ += frame.distance / static_cast<double>(solution.rows.size());
  }
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(6, shared);
  for (const FrameRows& frame : solution.rows) {
    // A motion of the frame is one of the board about its middle, and a shift of the middle.
    Eigen::Matrix<double, 6, 6> motion_by_frame = Eigen::Matrix<double, 6, 6>::Zero();
    motion_by_frame.topLeftCorner<3, 3>().setIdentity();
    motion_by_frame.bottomRows<3>() = ByFrame(frame.middle_in_rig, distance_) / frame.distance;
    const Eigen::MatrixXd by_frame = frame.by_motion * motion_by_frame;
    normal += by_frame.transpose() * by_frame;
    right += by_frame.transpose() * frame.by_shared;
  }
  frame_by_shared_ = -normal.ldlt().solve(right);
}

std::optional<Eigen::MatrixXd> ProjectionSensitivity::At(size_t camera,
                                                         const Eigen::Vector2d& pixel,
                                                         double distance) const {
  const RigCamera& rig_camera = solution_.rig.cameras[camera];
  const auto ray = rig_camera.camera.RayFromPixel(pixel);
  if (!ray) return std::nullopt;
  const Eigen::Vector3d p_in_rig = rig_camera.cam_from_rig.Inverse() * (distance * *ray);
  const PixelDerivatives d = DerivativesAt(solution_.rig, solution_.layout, camera, p_in_rig);
  return d.by_shared + d.by_point * ByFrame(p_in_rig, distance_) * frame_by_shared_;
}

double ImageMap::Largest() const {
  const auto finite = Only(values, [](double v) { return std::isfinite(v); });
  return finite.empty() ? std::numeric_limits<double>::quiet_NaN()
                        : *std::max_element(finite.begin(), finite.end());
}

double ImageMap::Quantile(double share) const {
  auto some = Only(values, [](double v) { return !std::isnan(v); });
  if (some.empty()) return std::numeric_limits<double>::quiet_NaN();
  return QuantileOf(some, share);
}

Eigen::Vector2d CellCentre(const ImageMap& map, const LensCamera& camera, int column, int row) {
  return {(column + 0.5) * camera.width_px / map.columns,
          (row + 0.5) * camera.height_px / map.rows};
}

ImageMap EmptyMap(const LensCamera& camera) {
  ImageMap map;
  map.columns = kMapColumns;
  map.rows = std::clamp(kMapColumns * camera.height_px / camera.width_px, 1, 4 * kMapColumns);
  map.values.assign(static_cast<size_t>(map.columns * map.rows),
                    std::numeric_limits<double>::quiet_NaN());
  return map;
}

ImageMap UncertaintyMap(const RigSolution& solution, const ProjectionSensitivity& sensitivity,
                        const Eigen::MatrixXd& covariance, size_t camera, double distance) {
  return Mapped(solution, sensitivity, camera, distance, [&](const Eigen::MatrixXd& by_shared) {
    const Eigen::Matrix2d variance = by_shared * covariance * by_shared.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(variance, Eigen::EigenvaluesOnly);
    return RootOfVariance(solver.eigenvalues()[1]);
  });
}

ImageMap ShiftMap(const RigSolution& solution, const ProjectionSensitivity& sensitivity,
                  const Eigen::VectorXd& difference, size_t camera, double distance) {
  return Mapped(solution, sensitivity, camera, distance,
                [&](const Eigen::MatrixXd& by_shared) { return (by_shared * difference).norm(); });
}

ImageMap SpreadMap(const LensCamera& lens, std::span<const OtherModel> others, double distance,
                   std::string* largest) {
  ImageMap map = EmptyMap(lens);
  double most = -1;
  for (int row = 0; row < map.rows; ++row) {
    for (int column = 0; column < map.columns; ++column) {
      const Eigen::Vector2d pixel = CellCentre(map, lens, column, row);
      double& value = map.values[static_cast<size_t>(row * map.columns + column)];
      value = 0;
      for (const OtherModel& other : others) {
        const double difference = other.DifferenceAt(pixel, distance).value_or(0);
        if (std::isinf(difference) && !IsAskedFor(lens, pixel)) continue;
        value = std::max(value, difference);
        if (difference <= most) continue;
        most = difference;
        if (largest != nullptr) *largest = NameOf(other.model);
      }
    }
  }
  return map;
}

ImageMap Combined(ImageMap uncertainty, const ImageMap& spread) {
  for (size_t i = 0; i < uncertainty.values.size(); ++i) {
    uncertainty.values[i] = std::hypot(uncertainty.values[i], spread.values[i]);
  }
  return uncertainty;
}

double BoardDistance(const Board& board, const Rig& rig, size_t camera) {
  std::vector<double> distances;
  for (const RigView& view : rig.views) {
    if (view.camera != camera) continue;
    distances.push_back(
        (rig.cameras[camera].cam_from_rig * (rig.rig_from_board[view.frame] * MiddleOf(board)))
            .norm());
  }
  if (distances.empty()) return std::numeric_limits<double>::quiet_NaN();
  return UpperMedian(distances);
}

}  // namespace dtr::calib
