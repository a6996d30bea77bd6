// calib/solve/rig_system.h -- a rig's residuals and their derivatives, frame by frame.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "calib/boards/board.h"
#include "calib/solve/arrow_information.h"
#include "calib/solve/rig.h"

namespace dtr::calib {

/// Which corner a pair of rows is about.
struct RowOrigin {
  size_t view = 0;    ///< of Rig::views
  size_t corner = 0;  ///< of the view's corners
};

/// The corners of one frame that count: two rows each, x then y. Residuals are predicted minus
/// observed, px.
struct FrameRows {
  size_t frame = 0;
  std::vector<RowOrigin> origins;
  Eigen::VectorXd residuals;
  Eigen::MatrixXd by_shared;  ///< columns as RigLayout has them
  /// By the motion (w, v) of rig_from_board about the board's middle; v in units of `distance`.
  Eigen::MatrixXd by_motion;
  Eigen::Vector3d middle_in_rig;
  double distance = 1;  ///< of the board's middle from the rig's origin
};

/// Rows of every frame that has any. Throws Error where a corner has no pixel: rigs whose outliers
/// are named have none such.
std::vector<FrameRows> RowsOf(const Board& board, const Rig& rig, const RigLayout& layout);

/// What the rows say, inverted. Throws Error, naming the parameter, where one is not determined.
ArrowInformation InformationOf(const std::vector<FrameRows>& rows, const RigLayout& layout);

/// How a pixel follows the unknowns: d pixel = by_shared * d shared + by_point * d p_in_rig, for a
/// camera and a point seen by it. Throws Error where the point has no pixel.
struct PixelDerivatives {
  Eigen::MatrixXd by_shared;
  Eigen::Matrix<double, 2, 3> by_point;
};
PixelDerivatives DerivativesAt(const Rig& rig, const RigLayout& layout, size_t camera,
                               const Eigen::Vector3d& p_in_rig);

}  // namespace dtr::calib
