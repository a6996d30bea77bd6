#include "calib/solve/choose_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <set>

#include "calib/models/radial_bend.h"
#include "calib/solve/board_start.h"
#include "calib/solve/term_uncertainty.h"
#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/random.h"

namespace dtr::calib {
namespace {

constexpr size_t kMinViewsToChoose = 5;  // 4 to solve from, 1 to hold out
// Held-out photos share the print, the lighting and the corner detector with the others: of their
// errors, too, more coefficients explain a part. Gains below these are none of the lens for sure.
constexpr double kMinRelativeGain = 0.1;  // of the held-out RMS
constexpr double kMinGainPx = 0.005;      // far below what a corner detector does (0.03 px)

// Sum of squared residual lengths over a view's corners, and their number.
struct ViewError {
  double squares = 0;
  int corners = 0;
};

double Rms(std::span<const ViewError> errors, std::span<const size_t> picked) {
  double squares = 0;
  int corners = 0;
  for (const size_t i : picked) {
    squares += errors[i].squares;
    corners += errors[i].corners;
  }
  return std::sqrt(squares / std::max(1, corners));
}

// Ids of corners per view that no solution uses: not the lens is to blame for them.
std::map<std::string, std::vector<int>> DisbelievedByAll(std::span<const ModelScore> scores,
                                                         std::span<const BoardView> views) {
  std::map<std::string, std::vector<int>> disbelieved;
  for (const BoardView& view : views) {
    std::set<int> left;
    for (const BoardCorner& corner : view.corners) left.insert(corner.id);
    for (const ModelScore& score : scores) {
      if (!score.solution) continue;
      const auto& solved = score.solution->views;
      const auto found = std::find_if(solved.begin(), solved.end(),
                                      [&](const SolvedView& s) { return s.name == view.name; });
      if (found == solved.end()) continue;
      for (const BoardCorner& corner : view.corners) {
        if (!Holds(found->outliers, corner.id)) left.erase(corner.id);
      }
    }
    disbelieved[view.name].assign(left.begin(), left.end());
  }
  return disbelieved;
}

ViewError HeldOutError(const Board& board, const BoardView& view, const LensCamera& camera,
                       std::span<const int> ignored) {
  const auto pose = SolvePose(board, view, camera, ignored);
  if (!pose) throw Error(view.name + ": held out, no pose explains its corners");
  const auto lengths = ResidualLengths(board, view, camera, *pose);
  ViewError error;
  for (size_t j = 0; j < lengths.size(); ++j) {
    if (Holds(ignored, view.corners[j].id)) continue;
    if (!std::isfinite(lengths[j])) throw Error(view.name + ": held out, a corner has no pixel");
    error.squares += lengths[j] * lengths[j];
    ++error.corners;
  }
  return error;
}

// Errors per view of one fold, by the camera that the other folds give.
std::vector<std::pair<size_t, ViewError>> FoldErrors(
    const Board& board, std::span<const BoardView> views, const BoardSolution& whole, size_t fold,
    size_t folds, const SolveOptions& options,
    const std::map<std::string, std::vector<int>>& disbelieved) {
  std::vector<BoardView> training;
  for (size_t i = 0; i < views.size(); ++i) {
    if (i % folds != fold) training.push_back(views[i]);
  }
  // Started from scratch: the solution of all views has seen what is held out. It only has to
  // explain boards; whether the image is covered was asked of the whole.
  SolveOptions training_options = options;
  training_options.cover_image = false;
  const LensCamera camera = SolveBoard(board, training, whole.camera.width_px,
                                       whole.camera.height_px, whole.model, training_options)
                                .camera;
  std::vector<std::pair<size_t, ViewError>> errors;
  for (size_t i = fold; i < views.size(); i += folds) {
    const auto& ignored = disbelieved.at(views[i].name);
    if (ignored.size() + 4 > views[i].corners.size()) continue;
    errors.emplace_back(i, HeldOutError(board, views[i], camera, ignored));
  }
  return errors;
}

// Counts the solves of a choice: of every model all views, and every fold.
class SolveCount {
 public:
  SolveCount(const ChoiceOptions& options, size_t folds) : progress_(options.progress) {
    const size_t solves = std::size(kBoardModels) * (1 + folds);
    if (progress_ != nullptr) progress_->Stage(options.stage, static_cast<int>(solves));
  }
  // May be called from any thread.
  void Done() {
    if (progress_ == nullptr) return;
    progress_->ThrowIfInterrupted();
    progress_->Update(++done_);
  }

 private:
  Progress* progress_;
  std::atomic<int> done_ = 0;
};

size_t FoldsOf(std::span<const BoardView> views, const ChoiceOptions& options) {
  return std::min(views.size(), static_cast<size_t>(std::max(2, options.folds)));
}

std::vector<ModelScore> SolveAll(const Board& board, std::span<const BoardView> views, int width_px,
                                 int height_px, const ChoiceOptions& options, SolveCount& count) {
  std::vector<ModelScore> scores(std::size(kBoardModels));
  ParallelFor(0, static_cast<int>(scores.size()), [&](int m) {
    ModelScore& score = scores[static_cast<size_t>(m)];
    score.model = kBoardModels[m];
    score.coefficients = FreeParameterCount(score.model);
    try {
      score.solution = SolveBoard(board, views, width_px, height_px, score.model, options.solve);
    } catch (const Error& error) {
      score.refused = error.what();
    }
    count.Done();
  });
  return scores;
}

using ErrorsByModel = std::vector<std::vector<ViewError>>;

ErrorsByModel HoldOut(const Board& board, std::span<const BoardView> views,
                      const ChoiceOptions& options, std::vector<ModelScore>& scores,
                      SolveCount& count) {
  const auto disbelieved = DisbelievedByAll(scores, views);
  const size_t folds = FoldsOf(views, options);
  ErrorsByModel errors(scores.size(), std::vector<ViewError>(views.size()));
  std::vector<std::string> refused(scores.size() * folds);
  ParallelFor(0, static_cast<int>(refused.size()), [&](int task) {
    const auto at = static_cast<size_t>(task);
    const size_t m = at / folds, fold = at % folds;
    if (!scores[m].solution) return count.Done();
    try {
      for (const auto& [i, error] :
           FoldErrors(board, views, *scores[m].solution, fold, folds, options.solve, disbelieved)) {
        errors[m][i] = error;
      }
    } catch (const Error& error) {
      refused[at] = error.what();
    }
    count.Done();
  });
  for (size_t at = 0; at < refused.size(); ++at) {
    ModelScore& score = scores[at / folds];
    if (!refused[at].empty() && score.refused.empty()) {
      score.refused = fmt::format("without a part of the views: {}", refused[at]);
    }
  }
  return errors;
}

RadialBend BendOf(const BoardSolution& solution, std::span<const BoardView> views) {
  double seen_px = 0;
  for (const SolvedView& solved : solution.views) {
    const auto view = std::find_if(views.begin(), views.end(),
                                   [&](const BoardView& v) { return v.name == solved.name; });
    seen_px = std::max(seen_px, OutermostPx(solution.camera, view->corners, solved.outliers));
  }
  return RadialBendOf(solution.camera, seen_px);
}

std::string TextOf(const RadialBend& bend) {
  const std::string where = fmt::format(
      "between the outermost corner seen, {:.0f} px from the "
      "principal point, and the image's corner at {:.0f} px",
      bend.seen_px, bend.border_px);
  if (bend.folds) return "folds back " + where;
  return fmt::format(
      "bends {}: its scale changes by a factor of {:.2f} there, by {:.2f} where "
      "corners were seen",
      where, std::exp(bend.beyond_change), std::exp(bend.seen_change));
}

// What speaks against a solution beside its error: it bends where no corner holds it, or corners
// leave one of its coefficients open. Empty: nothing.
std::string WhyImplausible(const BoardSolution& solution, std::span<const BoardView> views) {
  const RadialBend bend = BendOf(solution, views);
  if (!bend.Plausible()) return TextOf(bend);
  const TermUncertainty term =
      MostUncertainTerm(solution.model, solution.camera, solution.covariance);
  if (term.share <= kMaxTermShare) return "";
  return fmt::format("leaves {} open: it moves the image's corner by {:.0f} % of its distance",
                     TextOfTerm(solution.model, solution.camera, solution.covariance, term.index),
                     100 * term.share);
}

// Implausible models do not count where another one explains held-out views nearly as well.
void RejectImplausible(std::span<const BoardView> views, std::vector<ModelScore>& scores) {
  std::vector<std::string> why(scores.size());
  double least = std::numeric_limits<double>::infinity();
  for (size_t m = 0; m < scores.size(); ++m) {
    if (!scores[m].refused.empty()) continue;
    why[m] = WhyImplausible(*scores[m].solution, views);
    if (why[m].empty()) least = std::min(least, scores[m].held_out_rms_px);
  }
  for (size_t m = 0; m < scores.size(); ++m) {
    ModelScore& score = scores[m];
    if (!score.refused.empty() || why[m].empty()) continue;
    if (least <= kBendGivesWay * score.held_out_rms_px + kMinGainPx) score.refused = why[m];
  }
}

// Percentile interval of RMS(model) - RMS(best) over resampled views.
void Bootstrap(const ErrorsByModel& errors, size_t best, const ChoiceOptions& options,
               std::vector<ModelScore>& scores) {
  const size_t views = errors[best].size();
  std::vector<std::vector<double>> differences(scores.size());
  Random random(HashOf(options.seed, 0xb007));
  for (int k = 0; k < options.resamples; ++k) {
    std::vector<size_t> picked(views);
    for (size_t& i : picked) i = static_cast<size_t>(random.Index(static_cast<int>(views)));
    const double of_best = Rms(errors[best], picked);
    for (size_t m = 0; m < scores.size(); ++m) {
      if (scores[m].refused.empty()) {
        differences[m].push_back(Rms(errors[m], picked) - of_best);
      }
    }
  }
  const double tail = 0.5 * (1 - options.confidence);
  for (size_t m = 0; m < scores.size(); ++m) {
    auto& d = differences[m];
    if (d.empty()) continue;
    std::sort(d.begin(), d.end());
    const auto last = static_cast<double>(d.size() - 1);
    scores[m].low_px = d[static_cast<size_t>(tail * last)];
    scores[m].high_px = d[static_cast<size_t>((1 - tail) * last)];
  }
}

}  // namespace

bool NotSeparated(double rms_px, double min_px) {
  return rms_px - min_px <= std::max(kMinRelativeGain * min_px, kMinGainPx);
}

ModelChoice ChooseModel(const Board& board, std::span<const BoardView> views, int width_px,
                        int height_px, const ChoiceOptions& options) {
  if (views.size() < kMinViewsToChoose) {
    throw Error(
        fmt::format("`model` auto: expected at least {} images with the board to hold some "
                    "out, found {}; take more, or name a model",
                    kMinViewsToChoose, views.size()));
  }
  ModelChoice choice;
  SolveCount count(options, FoldsOf(views, options));
  choice.scores = SolveAll(board, views, width_px, height_px, options, count);
  const ErrorsByModel errors = HoldOut(board, views, options, choice.scores, count);
  std::vector<size_t> all(views.size());
  for (size_t i = 0; i < all.size(); ++i) all[i] = i;
  for (size_t m = 0; m < choice.scores.size(); ++m) {
    if (choice.scores[m].refused.empty()) choice.scores[m].held_out_rms_px = Rms(errors[m], all);
  }
  RejectImplausible(views, choice.scores);
  std::vector<size_t> counting;
  for (size_t m = 0; m < choice.scores.size(); ++m) {
    if (choice.scores[m].refused.empty()) counting.push_back(m);
  }
  if (counting.empty()) throw Error(choice.scores.front().refused);
  choice.best = *std::min_element(counting.begin(), counting.end(), [&](size_t a, size_t b) {
    return choice.scores[a].held_out_rms_px < choice.scores[b].held_out_rms_px;
  });
  Bootstrap(errors, choice.best, options, choice.scores);
  choice.chosen = choice.best;
  const double min_px = choice.scores[choice.best].held_out_rms_px;
  for (const size_t m : counting) {
    const ModelScore &score = choice.scores[m], &chosen = choice.scores[choice.chosen];
    const bool as_good = score.low_px <= 0 || NotSeparated(score.held_out_rms_px, min_px);
    if (as_good && ComplexityOf(score.model) < ComplexityOf(chosen.model)) choice.chosen = m;
  }
  return choice;
}

}  // namespace dtr::calib
