// calib/solve/board_solve.h -- one camera from views of a board, by least squares.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/boards/board.h"
#include "calib/boards/observations.h"
#include "calib/models/board_model.h"
#include "calib/solve/arrow_information.h"
#include "dtr/base/progress.h"
#include "dtr/types/pose.h"

namespace dtr::calib {

enum class Loss {
  kRobust,     ///< outliers are found, named and left out; the rest is fitted by least squares
  kQuadratic,  ///< every corner counts, as in OpenCV's calibrateCamera
};

struct SolveOptions {
  Loss loss = Loss::kRobust;
  /// A corner farther from its prediction than this many standard deviations is an outlier. Of
  /// normal errors exp(-k^2 / 2) are: 4e-6 at 5.
  double outlier_sigmas = 5;
  /// Reject a distortion that turns back inside the image (CoversImage). Off where a camera only
  /// has to explain boards and will not be kept.
  bool cover_image = true;
  /// Shows every iteration of a rig's solve, and may interrupt before it; may be null.
  Progress* progress = nullptr;
};

/// A view as the solution explains it.
struct SolvedView {
  std::string name;
  Pose cam_from_board;
  std::vector<int> outliers;  ///< ids of the corners that were not used
  double rms_px = 0;          ///< over the corners that were used
};

/// A calibrated camera. Residuals are predicted minus observed; RMS figures are the root of the
/// mean squared length of the residual vectors, OpenCV's way.
struct BoardSolution {
  BoardModel model = BoardModel::kPinhole;
  LensCamera camera;
  std::vector<SolvedView> views;
  std::vector<LeftOut> left_out;  ///< views that no pose explains, or whose corners mostly disagree
  int corners = 0, outliers = 0;  ///< used, and not used although their view is
  double rms_px = 0;
  /// Standard deviation of a coordinate of a corner, from the residuals and the degrees of freedom:
  /// sqrt(sum of squares / (2 corners - parameters)).
  double sigma_px = 0;
  /// Covariance of FreeParameterNames(model), for corner noise of sigma_px.
  Eigen::MatrixXd covariance;
  /// Information of everything for unit noise, the views' poses in the order of `views`; motions as
  /// PoseCoordinates (reprojection.h) has them with v in units of the distance of the board's
  /// middle.
  ArrowInformation information{0};

  std::vector<double> FreeParameters() const;
};

/// The middle of the board's corners: what pose motions turn about.
Eigen::Vector3d MiddleOf(const Board& board);

/// Finds the camera of this model and the poses of the views that explain the corners best:
/// Levenberg-Marquardt (Ceres) on centred and scaled parameters. With Loss::kRobust first under
/// Cauchy's loss, with a scale from the residuals themselves, then least squares on the corners
/// within `outlier_sigmas`, until that set does not change. Covariances are those of this last step
/// (Hartley & Zisserman, 2nd ed., sec. 5.2; sigma from the residuals).
///
/// Throws Error, naming what is missing, where the corners do not determine the camera: fewer than
/// 3 views, boards that are all parallel, a parameter without influence, a focal length uncertain
/// by more than 10 %, a distortion that turns back inside the image. Never returns a number that is
/// not finite. The same inputs give the same bits.
BoardSolution SolveBoard(const Board& board, std::span<const BoardView> views, int width_px,
                         int height_px, BoardModel model, const SolveOptions& options = {});

/// The pose alone, the camera as given: least squares on all corners but those in `ignored`
/// (sorted ids). Empty where no pose explains them. Throws Error for CameraModel::kFov, which
/// boards are not solved with.
std::optional<Pose> SolvePose(const Board& board, const BoardView& view, const LensCamera& camera,
                              std::span<const int> ignored = {});

/// What is said of a lens that CoversImage rejects.
std::string TurnsBack(BoardModel model);

/// True when `ids`, sorted, holds `id`.
bool Holds(std::span<const int> ids, int id);

}  // namespace dtr::calib
