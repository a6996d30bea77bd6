// calib/files/calibration.h -- a calibration with everything it was made from.
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/boards/board.h"
#include "calib/boards/observations.h"
#include "calib/models/board_model.h"
#include "dtr/types/pose.h"

namespace dtr::calib {

/// Of a rig whose cameras take their images when they like.
struct KeptDelay {
  /// Its images of a frame are later than the first camera's by this, in frames, and the standard
  /// deviation.
  double frames = 0, sigma = 0;
  /// Its corners are kept where they would have been seen at the moment of the frame's camera with
  /// the least delay.
  bool corners_moved = false;
};

/// A camera as a solve left it.
struct CalibratedCamera {
  std::string name;
  BoardModel model = BoardModel::kPinhole;
  LensCamera camera;
  Eigen::MatrixXd covariance;       ///< of FreeParameterNames(model); zero where the lens was given
  double rms_px = 0, sigma_px = 0;  ///< as BoardSolution has them
  /// Of a rig; frame `rig` is the first camera's. The covariance, 6 x 6, is of (w, v) as RigLayout
  /// (solve/rig.h) has them; empty for the first camera and outside of rigs.
  Pose cam_from_rig{};
  Eigen::MatrixXd place_covariance{};
  std::optional<KeptDelay> delay{};
};

/// A view of the board: what was seen, and how the calibration explains it.
struct CalibratedView {
  BoardView seen;
  size_t camera = 0;  ///< index into Calibration::cameras
  size_t frame = 0;   ///< views of one frame show the board at the same time step; in order of time
  Pose cam_from_board;
  std::vector<int> outliers;  ///< rising ids of corners that were not used
};

/// A lens model that was tried.
struct TriedModel {
  BoardModel model = BoardModel::kPinhole;
  bool chosen = false;
  std::optional<double> held_out_rms_px;  ///< empty where it was rejected
  double low_px = 0, high_px = 0;         ///< interval of the difference to the best model's
  std::string refused;                    ///< why; empty where it was not
};

struct Calibration {
  Board board;
  std::vector<CalibratedCamera> cameras;
  std::vector<CalibratedView> views;
  std::vector<LeftOut> left_out;
  std::vector<TriedModel> models;  ///< of --model auto
  bool lenses_given = false;       ///< of a rig whose lenses were not solved for
};

/// Largest frame number in a file.
inline constexpr size_t kLargestFrame = 1'000'000;

/// Reads what WriteCalibration wrote (docs/CALIBRATION.md has the fields). Safe on any bytes: sizes
/// are bounded, every number finite, ids inside the board, covariances symmetric with positive
/// diagonals, poses rotations. Throws Error naming file and field.
Calibration ReadCalibration(const std::filesystem::path& file);

/// Writes a .json file, atomically. Doubles read back exactly.
void WriteCalibration(const std::filesystem::path& file, const Calibration& calibration);

/// Largest calibration file that is read: 100 000 views of 50 corners.
inline constexpr std::uintmax_t kLargestCalibrationBytes = 256u << 20;

}  // namespace dtr::calib
