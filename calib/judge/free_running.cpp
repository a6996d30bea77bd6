#include "calib/judge/free_running.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/judge/patterns.h"
#include "calib/lens_map.h"
#include "calib/precision.h"
#include "calib/solve/least_squares.h"
#include "calib/solve/rig_start.h"
#include "dtr/base/error.h"

namespace dtr::calib {
namespace {

constexpr double kMaxDelay = 3;     // frames; farther apart, they are paired wrongly
constexpr double kWidestGap = 1.5;  // frames between neighbours that are interpolated
// Corners that count in one solve and not in the next move real delays by some tenths of a sigma.
constexpr double kSettledSigmas = 0.5;
constexpr double kChanceSigmas = 2;  // a camera that is taken for free stays so above this
constexpr int kMaxPasses = 16;
// From then on the corners that count stay the same: decided again in every solve, a few at the
// limit can take turns for ever, and the delays with them.
constexpr int kDecidedAfter = 5;
constexpr long kReach = 4;  // frames to either side that may be neighbours: kMaxDelay and one

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Delays = std::vector<double>;  // per camera, frames

// Where the board is around a frame's pose: (w, v), a turn and a shift of its middle, in the rig.
struct Motion {
  Vector6 value = Vector6::Zero(), speed = Vector6::Zero();  // speed: per frame
};

// The board's path through the frames of a solution, each at its own moment.
class Path {
 public:
  // `moments`: per frame, how much later than the frame its pose is, in frames.
  Path(const Board& board, const RigSolution& solution, const std::vector<double>& moments)
      : middle_(MiddleOf(board)), poses_(solution.rig.rig_from_board) {
    seen_.assign(poses_.size(), false);
    for (const FrameRows& frame : solution.rows) seen_[frame.frame] = true;
    for (size_t f = 0; f < poses_.size(); ++f) {
      times_.push_back(static_cast<double>(f) + moments[f]);
    }
  }

  // Whether a frame has a pose.
  bool Has(size_t frame) const { return seen_[frame]; }

  // The board's motion from a frame's pose to `delay` frames after the frame; empty where its
  // moment lies between no two frames that are near enough.
  std::optional<Motion> To(size_t frame, double delay) const {
    const double time = static_cast<double>(frame) + delay;
    const std::vector<size_t> around = Around(frame, time);
    if (around.empty()) return std::nullopt;
    // Lagrange's polynomial, and its derivative.
    Motion motion;
    for (const size_t k : around) {
      double weight = 1, slope = 0;
      for (const size_t other : around) {
        if (other == k) continue;
        weight *= (time - times_[other]) / (times_[k] - times_[other]);
        double part = 1 / (times_[k] - times_[other]);
        for (const size_t third : around) {
          if (third == k || third == other) continue;
          part *= (time - times_[third]) / (times_[k] - times_[third]);
        }
        slope += part;
      }
      const Vector6 way = Between(frame, k);
      motion.value += weight * way;
      motion.speed += slope * way;
    }
    return motion;
  }

  // A frame's pose after a motion.
  Pose Moved(size_t frame, const Vector6& motion) const {
    const Eigen::Vector3d turn = motion.head<3>();
    Pose moved;
    moved.rotation = poses_[frame].rotation;
    if (turn.norm() > 0) {
      moved.rotation =
          (Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized())) * moved.rotation)
              .normalized();
    }
    moved.translation = poses_[frame] * middle_ + motion.tail<3>() - moved.rotation * middle_;
    return moved;
  }

 private:
  Vector6 Between(size_t from, size_t to) const {
    const Eigen::AngleAxisd turn(poses_[to].rotation * poses_[from].rotation.conjugate());
    Vector6 way;
    way << turn.angle() * turn.axis(), poses_[to] * middle_ - poses_[from] * middle_;
    return way;
  }

  // Up to four frames around a moment, in order of time; empty where it lies between no two.
  std::vector<size_t> Around(size_t frame, double time) const {
    std::vector<size_t> near;
    const auto first = std::max<long>(0, static_cast<long>(frame) - kReach);
    const auto last =
        std::min<long>(static_cast<long>(poses_.size()) - 1, static_cast<long>(frame) + kReach);
    for (long k = first; k <= last; ++k) {
      if (seen_[static_cast<size_t>(k)]) near.push_back(static_cast<size_t>(k));
    }
    std::sort(near.begin(), near.end(), [&](size_t a, size_t b) { return times_[a] < times_[b]; });
    const auto follows = [&](size_t i) {  // the next one, near enough and later
      if (i + 1 >= near.size()) return false;
      const double gap = times_[near[i + 1]] - times_[near[i]];
      return gap > 0 && gap <= kWidestGap;
    };
    for (size_t i = 0; i < near.size(); ++i) {
      if (!follows(i) || time < times_[near[i]] || time > times_[near[i + 1]]) continue;
      std::vector<size_t> around;
      if (i > 0 && follows(i - 1)) around.push_back(near[i - 1]);
      around.insert(around.end(), {near[i], near[i + 1]});
      if (follows(i + 1)) around.push_back(near[i + 2]);
      return around;
    }
    return {};
  }

  Eigen::Vector3d middle_;
  const std::vector<Pose>& poses_;
  std::vector<bool> seen_;
  std::vector<double> times_;
};

// How a frame's residuals (predicted less observed) follow more delay of a camera than its corners
// were moved by, for every camera but the first. (Corners are moved to the moment of one of the
// frame's cameras: what that one's delay does to all of them is a motion of the frame's pose, which
// is free.)
Eigen::MatrixXd DelayColumns(const RigSolution& solution, const Path& path, const Delays& delays,
                             const FrameRows& frame) {
  Eigen::MatrixXd columns =
      Eigen::MatrixXd::Zero(frame.residuals.size(), static_cast<long>(delays.size()) - 1);
  std::vector<std::optional<Motion>> motions;
  for (const double delay : delays) {
    motions.push_back(path.To(frame.frame, delay));
    if (motions.back()) motions.back()->speed.tail<3>() /= frame.distance;
  }
  for (size_t i = 0; i < frame.origins.size(); ++i) {
    const size_t camera = solution.rig.views[frame.origins[i].view].camera;
    if (camera == 0 || !motions[camera]) continue;
    const auto at = 2 * static_cast<long>(i);
    columns.block<2, 1>(at, static_cast<long>(camera) - 1) =
        -frame.by_motion.middleRows<2>(at) * motions[camera]->speed;
  }
  return columns;
}

// What the residuals of a solution say about delays beyond those that its corners were moved by.
std::vector<std::optional<CameraDelay>> MoreDelay(const RigSolution& solution, const Path& path,
                                                  const Delays& delays) {
  const PatternTest test = TestSharedPattern(solution, [&](const FrameRows& frame) {
    return DelayColumns(solution, path, delays, frame);
  });
  std::vector<std::optional<CameraDelay>> more(delays.size());
  more[0] = CameraDelay{};
  for (size_t i = 0; i < test.coefficients.size(); ++i) {
    if (!std::isfinite(test.coefficients[i])) continue;  // nothing is known of this camera
    more[i + 1] = CameraDelay{test.coefficients[i], test.sigmas[i]};
  }
  return more;
}

// The views with their corners where they would be seen at one moment of their frame: that of its
// camera with the least delay, which `moments` keeps.
std::vector<RigView> MovedViews(const Board& board, const RigSolution& solution, const Path& path,
                                const std::vector<RigView>& views, const Delays& delays,
                                std::vector<double>& moments, std::vector<LeftOut>& left_out) {
  std::vector<std::optional<size_t>> reference(moments.size());
  moments.assign(moments.size(), 0);
  for (const RigView& view : views) {
    auto& best = reference[view.frame];
    if (!path.Has(view.frame)) continue;
    if (!best || std::abs(delays[view.camera]) < std::abs(delays[*best])) best = view.camera;
    moments[view.frame] = delays[*best];
  }
  std::vector<LensMap> lenses;
  for (const RigCamera& camera : solution.rig.cameras) lenses.emplace_back(camera.camera);
  std::vector<RigView> moved;
  for (const RigView& view : views) {
    RigView at = view;
    const auto best = reference[view.frame];
    if (!best || delays[view.camera] == delays[*best]) {
      moved.push_back(std::move(at));
      continue;
    }
    const auto own = path.To(view.frame, delays[view.camera]);
    const auto common = path.To(view.frame, delays[*best]);
    const RigCamera& camera = solution.rig.cameras[view.camera];
    bool told = own && common;
    for (BoardCorner& corner : at.seen.corners) {
      if (!told) break;
      const Eigen::Vector3d place = board.Corner(corner.id);
      const auto pixel_at = [&](const Motion& motion) {
        return lenses[view.camera].PixelFromCam(camera.cam_from_rig *
                                                (path.Moved(view.frame, motion.value) * place));
      };
      const auto then = pixel_at(*own), now = pixel_at(*common);
      told = then && now;
      if (told) corner.pixel -= *then - *now;
    }
    if (told) {
      moved.push_back(std::move(at));
    } else {
      left_out.push_back(
          {view.seen.name, "its camera's moment lies between no two frames that show the board"});
    }
  }
  return moved;
}

// Chessboards that were counted from the other end stay turned.
void KeepFlips(const Board& board, const std::vector<std::string>& flipped,
               std::vector<RigView>& views) {
  for (RigView& view : views) {
    if (std::find(flipped.begin(), flipped.end(), view.seen.name) != flipped.end()) {
      view = TurnedByHalf(board, view);
    }
  }
}

const RigView* ViewLike(const std::vector<RigView>& views, const RigView& wanted) {
  const auto found = std::find_if(views.begin(), views.end(), [&](const RigView& view) {
    return view.camera == wanted.camera && view.frame == wanted.frame;
  });
  return found == views.end() ? nullptr : &*found;
}

// Views and corners that a solve did not count are not to count any more. (Views that it did not
// get, for want of frames around their moment, stay.)
void KeepDecisions(const RigSolution& solution, std::vector<RigView>& views,
                   std::vector<LeftOut>& decided) {
  decided = solution.left_out;
  std::erase_if(views, [&](const RigView& view) {
    return std::any_of(decided.begin(), decided.end(),
                       [&](const LeftOut& item) { return item.name == view.seen.name; });
  });
  for (RigView& view : views) {
    const RigView* solved = ViewLike(solution.rig.views, view);
    if (solved != nullptr) view.outliers = solved->outliers;
  }
}

// Outliers that the solve was not given, as it had been decided on them, are views' outliers again.
void RestoreOutliers(const std::vector<RigView>& given, RigSolution& solution) {
  for (size_t v = 0; v < solution.rig.views.size(); ++v) {
    RigView& view = solution.rig.views[v];
    const RigView* all = ViewLike(given, view);
    if (all == nullptr || all->outliers.empty()) continue;
    for (FrameRows& frame : solution.rows) {
      for (RowOrigin& origin : frame.origins) {
        if (origin.view != v) continue;
        const int id = view.seen.corners[origin.corner].id;
        const auto at = std::find_if(all->seen.corners.begin(), all->seen.corners.end(),
                                     [&](const BoardCorner& corner) { return corner.id == id; });
        origin.corner = static_cast<size_t>(at - all->seen.corners.begin());
      }
    }
    view.seen = all->seen;
    view.outliers = all->outliers;
    solution.outliers += static_cast<int>(view.outliers.size());
  }
}

// The delays are unknowns, too: what is uncertain for them is uncertain.
void WidenByDelays(const Path& path, const Delays& delays, const std::vector<bool>& moved,
                   RigSolution& solution) {
  std::vector<long> free;
  for (size_t c = 1; c < moved.size(); ++c) {
    if (moved[c]) free.push_back(static_cast<long>(c) - 1);
  }
  if (free.empty()) return;
  const long shared = solution.layout.size(), count = static_cast<long>(free.size());
  ArrowInformation information(static_cast<int>(shared + count));
  for (const FrameRows& frame : solution.rows) {
    Eigen::MatrixXd by_shared(frame.residuals.size(), shared + count);
    by_shared << frame.by_shared, DelayColumns(solution, path, delays, frame)(Eigen::all, free);
    information.AddPose(by_shared, frame.by_motion);
  }
  if (!information.Invert()) {
    Reject(
        "the delays cannot be separated from the cameras' positions and intrinsics; show the board "
        "in more "
        "frames that follow each other, moving to different sides");
  }
  const double freedom = solution.freedom - static_cast<double>(count);
  solution.sigma_px *= std::sqrt(solution.freedom / freedom);
  solution.freedom = freedom;
  solution.covariance =
      VarianceOf(solution.sigma_px) * information.lens_covariance().topLeftCorner(shared, shared);
}

}  // namespace

std::vector<std::optional<CameraDelay>> DelaysOf(const Board& board, const RigSolution& solution) {
  const std::vector<double> moments(solution.rig.rig_from_board.size(), 0);
  return MoreDelay(solution, Path(board, solution, moments),
                   Delays(solution.rig.cameras.size(), 0));
}

FreeRunning SolveFreeRunning(const Board& board, std::span<const RigCameraInput> cameras,
                             std::vector<RigView> views, size_t frames, const RigOptions& options) {
  FreeRunning free;
  // As SolveRig does: from here on outliers are those that are decided on here.
  DropOutliers(views);
  Delays delays(cameras.size(), 0);  // that corners are moved by
  free.moved.assign(cameras.size(), false);
  std::vector<LeftOut> left_out, decided;
  std::vector<std::string> flipped;
  std::vector<RigView> moved = views;
  std::vector<double> moments(frames, 0);
  RigOptions solve = options;
  solve.solve.cover_image = false;  // of what is kept alone
  std::vector<RigCameraInput> inputs(cameras.begin(), cameras.end());
  std::string last;  // delays, and by how much they changed
  for (free.passes = 1; free.passes <= kMaxPasses; ++free.passes) {
    free.solution = SolveRig(board, inputs, moved, frames, solve);
    KeepFlips(board, free.solution.flipped, views);
    KeepFlips(board, free.solution.flipped, moved);
    flipped.insert(flipped.end(), free.solution.flipped.begin(), free.solution.flipped.end());
    // The next solve begins with these lenses; each camera's alone are found once.
    for (size_t c = 0; c < inputs.size(); ++c) {
      inputs[c].given = free.solution.rig.cameras[c].camera;
    }
    const Path path(board, free.solution, moments);
    free.delays = MoreDelay(free.solution, path, delays);
    Delays next(cameras.size(), 0);
    bool settled = true, any = false;
    last.clear();
    for (size_t c = 1; c < cameras.size(); ++c) {
      if (!free.delays[c]) continue;
      any = true;
      CameraDelay& delay = *free.delays[c];
      const double more = delay.frames;
      delay.frames += delays[c];
      if (!(std::abs(delay.frames) <= kMaxDelay)) {
        throw Error(fmt::format(
            "camera {}: expected photos within {} frames of camera {}'s, found {:+.1f}; its "
            "frames are paired with others than their own: cut the videos to one start",
            cameras[c].name, kMaxDelay, cameras[0].name, delay.frames));
      }
      const bool is_free =
          std::abs(delay.frames) > (free.moved[c] ? kChanceSigmas : kDelaySigmas) * delay.sigma;
      last += fmt::format("{}{} {:+.4f} +- {:.4f} by {:+.4f}", last.empty() ? "" : ", ",
                          cameras[c].name, delay.frames, delay.sigma, more);
      settled = settled && is_free == free.moved[c] &&
                (!is_free || std::abs(more) <= kSettledSigmas * delay.sigma);
      free.moved[c] = is_free;
      if (is_free) next[c] = delay.frames;
    }
    if (!any) {
      throw Error(
          "calibration: expected a board that moves through frames that follow each other, found "
          "none that determines the cameras' moments; show it in more frames, or let the cameras "
          "be "
          "synchronised");
    }
    if (settled) {
      WidenByDelays(path, delays, free.moved, free.solution);
      RestoreOutliers(moved, free.solution);
      free.solution.flipped = std::move(flipped);
      if (options.solve.cover_image && options.free_lenses) {
        RequireCoveredImages(free.solution.rig);
      }
      for (const auto* more : {&decided, &left_out}) {
        free.solution.left_out.insert(free.solution.left_out.end(), more->begin(), more->end());
      }
      return free;
    }
    if (free.passes == kDecidedAfter && solve.solve.loss == Loss::kRobust) {
      KeepDecisions(free.solution, views, decided);
      solve.solve.loss = Loss::kQuadratic;
    }
    delays = next;
    left_out.clear();
    moved = MovedViews(board, free.solution, path, views, delays, moments, left_out);
  }
  throw Error(
      fmt::format("calibration: expected delays that settle, found them still changing after {} "
                  "solves (frames: {}); show the board in more frames that follow each other",
                  kMaxPasses, last));
}

}  // namespace dtr::calib
