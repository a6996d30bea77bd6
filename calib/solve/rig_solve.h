// calib/solve/rig_solve.h -- cameras and their places relative to each other, by least squares.
#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/solve/board_solve.h"
#include "calib/solve/rig.h"
#include "calib/solve/rig_system.h"
#include "dtr/base/error.h"

namespace dtr::calib {

struct RigOptions {
  SolveOptions solve;
  bool free_lenses = true;  ///< off: lenses stay as they are given or as each camera's boards say
};

/// A calibrated rig. RMS figures as BoardSolution has them.
struct RigSolution {
  Rig rig;
  RigLayout layout{{}, true};
  std::vector<LeftOut> left_out;     ///< views that no pose explains, or whose corners disagree
  std::vector<std::string> flipped;  ///< chessboards whose corners were counted from the other end
  int corners = 0, outliers = 0;
  double rms_px = 0;
  std::vector<double> camera_rms_px;
  double sigma_px = 0;              ///< per coordinate, as BoardSolution::sigma_px
  Eigen::MatrixXd covariance;       ///< of the layout's unknowns, for noise of sigma_px
  ArrowInformation information{0};  ///< for unit noise; frames in the order of `rows`
  std::vector<FrameRows> rows;      ///< of the corners that count

  /// Residuals less unknowns: what sigma_px was divided by.
  double freedom = 0;
};

/// What a rig is made of before it is solved.
struct RigCameraInput {
  std::string name;
  BoardModel model = BoardModel::kPinhole;
  int width_px = 0, height_px = 0;
  /// Of the model; empty: found from this camera's own views. Where lenses are free, the solve
  /// begins with it.
  std::optional<LensCamera> given;
};

/// Solves each camera from its own views (SolveBoard), places the cameras by boards that several
/// of them saw at once (StartRig), then all lenses, places and boards together: Cauchy's loss, then
/// least squares on the corners within `outlier_sigmas` of their camera's own sigma. Corners that
/// `views` call outliers are dropped. One camera is a rig, too. Throws Error, naming camera and
/// reason, where the corners do not determine an unknown, and as SolveOptions::cover_image says.
/// The same inputs give the same bits.
RigSolution SolveRig(const Board& board, std::span<const RigCameraInput> cameras,
                     std::vector<RigView> views, size_t frames, const RigOptions& options = {});

/// A camera's distortion turns back inside its image (CoversImage).
class LensTurnsBack : public Error {
 public:
  LensTurnsBack(size_t camera, const std::string& what) : Error(what), camera_(camera) {}
  size_t camera() const { return camera_; }

 private:
  size_t camera_;
};
/// Throws LensTurnsBack, naming the camera.
void RequireCoveredImages(const Rig& rig);

/// Lenses and places as they are; of every frame the board's pose alone is fitted: by each view's
/// own pose, then least squares over all views of the frame. With Loss::kRobust corners beyond
/// `outlier_sigmas` are left out of the fit and named. Views that no pose explains are returned in
/// `left_out`; chessboards that were counted from the other end than their frame's first view are
/// counted again and named in `flipped`.
Rig FitFrames(const Board& board, std::vector<RigCamera> cameras, std::vector<RigView> views,
              size_t frames, const SolveOptions& options, std::vector<LeftOut>& left_out,
              std::vector<std::string>* flipped = nullptr);

/// Residual lengths per view, px; infinite for corners without a pixel.
std::vector<std::vector<double>> ResidualLengths(const Board& board, const Rig& rig);

}  // namespace dtr::calib
