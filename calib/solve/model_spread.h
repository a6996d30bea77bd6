// calib/solve/model_spread.h -- how far apart camera models are that explain the same corners.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "calib/solve/board_solve.h"

namespace dtr::calib {

/// Another model that the corners do not tell from the chosen one, solved from the same views.
struct OtherModel {
  BoardModel model = BoardModel::kPinhole;
  LensCamera own;       ///< the chosen model, solved from these views alone
  LensCamera camera;    ///< the other one
  Pose other_from_own;  ///< between their frames `cam`: as the corners have it
  double sigma_px = 0;  ///< of the other solve, BoardSolution::sigma_px

  /// Distance between where both draw what `own` sees at this pixel and distance (board units);
  /// infinite where the other one draws nothing, empty where `own` has no ray.
  std::optional<double> DifferenceAt(const Eigen::Vector2d& pixel, double distance) const;
};

/// All models that fit these views as well as the chosen one (the mean excess of a view's squared
/// residuals is within its standard error) and do not bend beyond the corners seen (radial_bend.h).
/// Models that contain the chosen one, and brown8, which no prior bounds beyond the corners, count
/// only where they fit clearly better (3 standard errors). Where the chosen one itself bends there,
/// also those that fit nearly as well (kBendGivesWay). Corners in `outliers` (sorted ids, by view)
/// are not used. As another model puts all boards into another frame, that motion is fitted to all
/// corners and taken out, as ProjectionSensitivity does to first order
/// (calib/validation/projection.h; D. Kogan, mrcal, "cross-reprojection"). Empty where the chosen
/// model itself cannot be solved from these views alone. The same for any number of threads.
std::vector<OtherModel> OtherModels(const Board& board, BoardModel chosen, int width_px,
                                    int height_px, std::span<const BoardView> views,
                                    std::span<const std::vector<int>> outliers);

}  // namespace dtr::calib
