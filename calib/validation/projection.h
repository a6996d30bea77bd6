// calib/validation/projection.h -- what uncertain unknowns do to pixels.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/solve/model_spread.h"
#include "calib/solve/rig_solve.h"

namespace dtr::calib {

/// How a pixel of a camera moves with the shared unknowns. Only boards tell where the cameras are,
/// so another lens means other poses of all boards: the same boards in another frame. That motion
/// of the frame, fitted to all observed corners, is taken out of the difference (mrcal's
/// "cross-reprojection" uncertainty; D. Kogan, mrcal, 2.5). What is left is a lens that draws
/// otherwise, not one that stands elsewhere.
class ProjectionSensitivity {
 public:
  explicit ProjectionSensitivity(const RigSolution& solution);

  /// d pixel by the shared unknowns for what this pixel shows at this distance from the camera
  /// (board units). Empty where the lens has no ray.
  std::optional<Eigen::MatrixXd> At(size_t camera, const Eigen::Vector2d& pixel,
                                    double distance) const;

 private:
  const RigSolution& solution_;
  double distance_ = 1;              // typical, of the boards: unit of the frame's shift
  Eigen::MatrixXd frame_by_shared_;  // the frame's motion (w, v / distance_), 6 rows
};

/// Samples of the image: a grid of cell centres, kMapColumns columns. Where the lens has no ray the
/// value is infinite, or not a number where none is asked for (IsAskedFor, models/board_model.h).
inline constexpr int kMapColumns = 24;
struct ImageMap {
  int columns = 0, rows = 0;
  std::vector<double> values;  ///< row-major
  double Largest() const;      ///< of the finite ones; NaN where there is none
  double Median() const { return Quantile(0.5); }
  /// Of all cells that are asked for, infinite ones the largest; NaN where there is none.
  double Quantile(double share) const;
};
/// Cell centre in pixels.
Eigen::Vector2d CellCentre(const ImageMap& map, const LensCamera& camera, int column, int row);
ImageMap EmptyMap(const LensCamera& camera);

/// Standard deviation of the projection in the direction in which it is largest, px.
ImageMap UncertaintyMap(const RigSolution& solution, const ProjectionSensitivity& sensitivity,
                        const Eigen::MatrixXd& covariance, size_t camera, double distance);
/// Length of the shift that a difference of the shared unknowns makes, px, to first order.
ImageMap ShiftMap(const RigSolution& solution, const ProjectionSensitivity& sensitivity,
                  const Eigen::VectorXd& difference, size_t camera, double distance);

/// Largest difference to the other models, px; 0 where nothing is asked for or there are none.
/// `largest`, where given, gets the name of the model that differs most.
ImageMap SpreadMap(const LensCamera& lens, std::span<const OtherModel> others, double distance,
                   std::string* largest = nullptr);
/// Root of the sum of squares, cell by cell.
ImageMap Combined(ImageMap uncertainty, const ImageMap& spread);

/// Median distance of the boards from a camera, board units.
double BoardDistance(const Board& board, const Rig& rig, size_t camera);

}  // namespace dtr::calib
