// calib/solve/choose_model.h -- the lens model that unseen views call for.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/solve/board_solve.h"

namespace dtr::calib {

struct ChoiceOptions {
  SolveOptions solve;
  int folds = 10;            ///< at most; never more than there are views
  int resamples = 2000;      ///< of the bootstrap
  double confidence = 0.95;  ///< of its intervals
  std::uint64_t seed = 0;
  /// Shows every solve, as a stage of this name, and may interrupt; may be null.
  Progress* progress = nullptr;
  std::string stage = "choosing the camera model";
};

/// How a model did on views that its solution had not seen.
struct ModelScore {
  BoardModel model = BoardModel::kPinhole;
  int coefficients = 0;                   ///< FreeParameterCount
  std::optional<BoardSolution> solution;  ///< of all views; empty when the model was rejected
  double held_out_rms_px = 0;
  /// Interval of (its held-out RMS - the best model's); both zero for the best one.
  double low_px = 0, high_px = 0;
  std::string refused;  ///< why the model does not count; empty when it does
};

struct ModelChoice {
  std::vector<ModelScore> scores;  ///< in the order of kBoardModels
  size_t best = 0;                 ///< least held-out RMS
  size_t chosen = 0;
};

/// A model that bends beyond the corners seen, or is not determined, gives way to another, unless
/// that one's RMS is this many times larger: then the lens is of its kind, and wants photos nearer
/// to the border.
inline constexpr double kBendGivesWay = 1.5;

/// True where an RMS is larger than the least one by no more than 10 % or 0.005 px. Photos share
/// the print, the lighting and the corner detector: of such errors, held out or not, more
/// coefficients explain a part, so a gain as small as this is not certain to be one of the lens.
bool NotSeparated(double rms_px, double min_px);

/// Held-out error: the views are dealt to `folds` groups in turn; each group is predicted by a
/// camera solved from all the others, its poses alone fitted (SolvePose). Corners that no model's
/// solution of all views uses are left out for every model. The best model is the one with the
/// least held-out RMS; a simpler one (ComplexityOf) is as good when the bootstrap interval of the
/// difference of their RMS (views drawn with replacement, the same for both; Efron & Tibshirani
/// 1993) reaches zero, or when the difference is below 10 % or 0.005 px: errors that all photos of
/// a board share favour coefficients in held-out photos too. Chosen is the simplest of those. A
/// model that bends or turns back between the outermost corner seen and the border of the image
/// (radial_bend.h), or of which corners leave a coefficient open (term_uncertainty.h), does not
/// count, unless all others err more (kBendGivesWay). Throws Error when
/// there are fewer than 5 views, or no model holds.
ModelChoice ChooseModel(const Board& board, std::span<const BoardView> views, int width_px,
                        int height_px, const ChoiceOptions& options = {});

}  // namespace dtr::calib
