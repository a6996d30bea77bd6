#include "calib/validation/patterns.h"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "calib/distributions.h"
#include "calib/precision.h"
#include "calib/residual_patterns.h"

namespace dtr::calib {
namespace {

// Every corner that may lie elsewhere is three unknowns, and work grows with their cube.
constexpr int kMaxCornersOfShutter = 150;
constexpr double kDependent = 1e-7;  // of columns of length 1: what is left of one that others span

// What is left of the rows of `rest` where the columns of `own` are fitted for this frame alone.
Eigen::MatrixXd Eliminated(const Eigen::MatrixXd& own, const Eigen::MatrixXd& rest, long* rank) {
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(own.rows(), own.cols());
  qr.setThreshold(kDependent);
  Eigen::MatrixXd scaled = own;
  for (long i = 0; i < scaled.cols(); ++i) {
    const double length = scaled.col(i).norm();
    if (length > 0) scaled.col(i) /= length;
  }
  qr.compute(scaled);
  *rank = qr.rank();
  const Eigen::MatrixXd turned = qr.householderQ().adjoint() * rest;
  return turned.bottomRows(rest.rows() - qr.rank());
}

// The triangle of more rows on top of it.
void Stack(const Eigen::MatrixXd& rows, Eigen::MatrixXd& triangle) {
  Eigen::MatrixXd all(triangle.rows() + rows.rows(), triangle.cols());
  all << triangle, rows;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(all);
  triangle = qr.matrixQR().topRows(triangle.cols()).triangularView<Eigen::Upper>();
}

// Of `rows` residuals; `below` is what they number less all unknowns.
PatternTest TestOf(double rows, double explained, double left, int freedom, double below) {
  PatternTest test;
  test.freedom = freedom;
  if (freedom <= 0 || !(below > 0)) return test;
  const double of_noise = freedom * left / below;
  test.amplitude_px = RootOfVariance((explained - of_noise) / rows);
  test.p = FisherSurvival((explained / freedom) / (left / below), freedom, below);
  return test;
}

// Where the i-th corner of a frame is drawn. Not where it was seen: patterns made of what was seen
// hold the residual itself.
Eigen::Vector2d PixelOf(const RigSolution& solution, const FrameRows& rows, size_t i) {
  const RowOrigin& origin = rows.origins[i];
  return solution.rig.views[origin.view].seen.corners[origin.corner].pixel +
         rows.residuals.segment<2>(2 * static_cast<long>(i));
}
size_t CameraOf(const RigSolution& solution, const FrameRows& rows, size_t i) {
  return solution.rig.views[rows.origins[i].view].camera;
}

}  // namespace

PatternTest TestSharedPattern(const RigSolution& solution, const PatternColumns& columns) {
  const long shared = solution.layout.size();
  long count = -1;
  Eigen::MatrixXd triangle;
  Eigen::VectorXd squares, rows;
  for (const FrameRows& frame : solution.rows) {
    const Eigen::MatrixXd pattern = columns(frame);
    if (count < 0) {
      count = pattern.cols();
      squares = rows = Eigen::VectorXd::Zero(count);
      triangle = Eigen::MatrixXd::Zero(shared + count + 1, shared + count + 1);
    }
    squares += pattern.colwise().squaredNorm();
    rows += (pattern.array() != 0).cast<double>().matrix().colwise().sum();
    Eigen::MatrixXd rest(frame.residuals.size(), shared + count + 1);
    rest << frame.by_shared, pattern, frame.residuals;
    long rank = 0;
    Stack(Eliminated(frame.by_motion, rest, &rank), triangle);
  }
  if (count <= 0) return {};
  // What no residual feels is not told, and hides nothing of the others.
  std::vector<long> felt;
  for (long i = 0; i < count; ++i) {
    if (squares[i] > 0) felt.push_back(i);
  }
  if (felt.empty()) return {};
  const auto felt_count = static_cast<long>(felt.size());
  Eigen::MatrixXd own = triangle.block(shared, shared, count, count)(Eigen::all, felt);
  const Eigen::VectorXd right = triangle.block(shared, shared + count, count, 1);
  const Eigen::VectorXd lengths = triangle.middleCols(shared, count)(Eigen::all, felt)
                                      .colwise()
                                      .norm()
                                      .cwiseMax(1e-300)
                                      .transpose();
  own = own * lengths.cwiseInverse().asDiagonal();
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(own.rows(), own.cols());
  qr.setThreshold(kDependent);
  qr.compute(own);
  const Eigen::VectorXd turned = qr.householderQ().adjoint() * right;
  const double explained = turned.head(qr.rank()).squaredNorm();
  const double left =
      std::pow(triangle(shared + count, shared + count), 2) + right.squaredNorm() - explained;
  const auto freedom = static_cast<int>(qr.rank());
  PatternTest test =
      TestOf(2.0 * solution.corners, explained, left, freedom, solution.freedom - freedom);
  if (qr.rank() < felt_count) return test;
  const Eigen::VectorXd c = qr.solve(right).cwiseQuotient(lengths);
  const Eigen::MatrixXd inverse =
      (lengths.cwiseInverse().asDiagonal() * (own.transpose() * own).inverse().eval() *
       lengths.cwiseInverse().asDiagonal());
  const double variance = VarianceOf(
      RootOfVariance(left / std::max(1.0, solution.freedom - static_cast<double>(felt_count))));
  const std::vector<double> untold(static_cast<size_t>(count),
                                   std::numeric_limits<double>::quiet_NaN());
  test.coefficients = test.sigmas = test.effects_px = untold;
  for (long i = 0; i < felt_count; ++i) {
    const long k = felt[static_cast<size_t>(i)];
    const auto at = static_cast<size_t>(k);
    test.coefficients[at] = c[i];
    test.sigmas[at] = std::sqrt(variance * inverse(i, i));
    test.effects_px[at] = std::abs(c[i]) * std::sqrt(squares[k] / std::max(1.0, rows[k]));
  }
  return test;
}

namespace {

// Least sum of squares of `rows` residuals with `own` fitted per frame, `shared` for all; by how
// many unknowns.
struct Fit {
  double squares = 0;
  long rows = 0, unknowns = 0;
};

Fit FitOf(std::span<const FrameRows> frames, const PatternColumns& own,
          const PatternColumns& shared) {
  Eigen::MatrixXd triangle;
  Fit fit;
  for (const FrameRows& frame : frames) {
    const Eigen::MatrixXd own_columns =
        own ? own(frame) : Eigen::MatrixXd(frame.residuals.size(), 0);
    const Eigen::MatrixXd shared_columns =
        shared ? shared(frame) : Eigen::MatrixXd(frame.residuals.size(), 0);
    Eigen::MatrixXd mine(frame.residuals.size(), frame.by_motion.cols() + own_columns.cols());
    mine << frame.by_motion, own_columns;
    const long count = frame.by_shared.cols() + shared_columns.cols();
    Eigen::MatrixXd rest(frame.residuals.size(), count + 1);
    rest << frame.by_shared, shared_columns, frame.residuals;
    if (triangle.size() == 0) triangle = Eigen::MatrixXd::Zero(count + 1, count + 1);
    long rank = 0;
    Stack(Eliminated(mine, rest, &rank), triangle);
    fit.unknowns += rank;
    fit.rows += frame.residuals.size();
  }
  if (triangle.size() == 0) return fit;
  // Shared columns may depend on each other: their part is solved with pivots.
  const long count = triangle.cols() - 1;
  Eigen::MatrixXd part = triangle.topLeftCorner(count, count);
  for (long i = 0; i < count; ++i) {
    const double length = part.col(i).norm();
    if (length > 0) part.col(i) /= length;
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(count, count);
  qr.setThreshold(kDependent);
  qr.compute(part);
  const Eigen::VectorXd turned = qr.householderQ().adjoint() * triangle.topRightCorner(count, 1);
  fit.squares = turned.tail(count - qr.rank()).squaredNorm() + std::pow(triangle(count, count), 2);
  fit.unknowns += qr.rank();
  return fit;
}

// How the pixel of the i-th corner of a frame follows the corner's place on the board.
Eigen::Matrix<double, 2, 3> ByCorner(const Board& board, const RigSolution& solution,
                                     const FrameRows& frame, size_t i) {
  const Eigen::Matrix3d rotation =
      solution.rig.rig_from_board[frame.frame].rotation.toRotationMatrix();
  return frame.by_motion.block<2, 3>(2 * static_cast<long>(i), 3) * rotation *
         (board.square / frame.distance);
}
int IdOf(const RigSolution& solution, const FrameRows& rows, size_t i) {
  const RowOrigin& origin = rows.origins[i];
  return solution.rig.views[origin.view].seen.corners[origin.corner].id;
}

// The rows of the corners that `place` knows; the others are left out.
std::vector<FrameRows> RowsOfCorners(const RigSolution& solution, const std::vector<int>& place) {
  std::vector<FrameRows> some;
  for (const FrameRows& frame : solution.rows) {
    FrameRows part = frame;
    part.origins.clear();
    std::vector<long> kept;
    for (size_t i = 0; i < frame.origins.size(); ++i) {
      if (place[static_cast<size_t>(IdOf(solution, frame, i))] < 0) continue;
      part.origins.push_back(frame.origins[i]);
      kept.insert(kept.end(), {2 * static_cast<long>(i), 2 * static_cast<long>(i) + 1});
    }
    if (kept.empty()) continue;
    part.residuals = frame.residuals(kept);
    part.by_shared = frame.by_shared(kept, Eigen::all);
    part.by_motion = frame.by_motion(kept, Eigen::all);
    some.push_back(std::move(part));
  }
  return some;
}

// At most `most` corners of the board, spread evenly over it: their places in the list, -1 for the
// others. Multiples of the golden ratio leave gaps of nearly equal length.
std::vector<int> SomeCorners(int corners, int most) {
  std::vector<int> place(static_cast<size_t>(corners), -1);
  int next = 0;
  for (int id = 0; id < corners; ++id) {
    const double turns = std::numbers::phi * id;
    const bool taken = corners <= most || (turns - std::floor(turns)) * corners < most;
    if (taken && next < most) place[static_cast<size_t>(id)] = next++;
  }
  return place;
}

}  // namespace

PatternTest TestFramePattern(std::span<const FrameRows> rows, const PatternColumns& columns,
                             const PatternColumns& nuisance) {
  const Fit without = FitOf(rows, {}, nuisance), with = FitOf(rows, columns, nuisance);
  return TestOf(static_cast<double>(with.rows), without.squares - with.squares, with.squares,
                static_cast<int>(with.unknowns - without.unknowns),
                static_cast<double>(with.rows - with.unknowns));
}

PatternTest TestRadial(const RigSolution& solution) {
  const size_t cameras = solution.rig.cameras.size();
  std::vector<double> reach(cameras, 1);
  const auto from_middle = [&](const FrameRows& frame, size_t i) -> Eigen::Vector2d {
    const PinholeCamera k = solution.rig.cameras[CameraOf(solution, frame, i)].camera.Pinhole();
    return PixelOf(solution, frame, i) - Eigen::Vector2d(k.cx_px(), k.cy_px());
  };
  for (const FrameRows& frame : solution.rows) {
    for (size_t i = 0; i < frame.origins.size(); ++i) {
      double& r = reach[CameraOf(solution, frame, i)];
      r = std::max(r, from_middle(frame, i).norm());
    }
  }
  return TestSharedPattern(solution, [&](const FrameRows& frame) {
    Eigen::MatrixXd columns =
        Eigen::MatrixXd::Zero(frame.residuals.size(), static_cast<long>(cameras) * kRings);
    for (size_t i = 0; i < frame.origins.size(); ++i) {
      const size_t camera = CameraOf(solution, frame, i);
      const Eigen::Vector2d way = from_middle(frame, i);
      const double radius = way.norm();
      if (!(radius > 0)) continue;
      const auto weights = RingWeights(radius / reach[camera]);
      for (size_t ring = 0; ring < kRings; ++ring) {
        columns.block<2, 1>(2 * static_cast<long>(i), static_cast<long>(camera * kRings + ring)) =
            weights[ring] * way / radius;
      }
    }
    return columns;
  });
}

PatternTest TestRegional(const RigSolution& solution) {
  const long per_camera = 2L * kPatternRegions * kPatternRegions;
  const long count = static_cast<long>(solution.rig.cameras.size()) * per_camera;
  return TestSharedPattern(solution, [&](const FrameRows& frame) {
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(frame.residuals.size(), count);
    for (size_t i = 0; i < frame.origins.size(); ++i) {
      const size_t camera = CameraOf(solution, frame, i);
      const LensCamera& lens = solution.rig.cameras[camera].camera;
      const int region =
          PatternRegionOf(PixelOf(solution, frame, i), lens.width_px, lens.height_px);
      const long at = static_cast<long>(camera) * per_camera + 2 * region;
      columns(2 * static_cast<long>(i), at) = 1;
      columns(2 * static_cast<long>(i) + 1, at + 1) = 1;
    }
    return columns;
  });
}

PatternTest TestBoardShape(const Board& board, const RigSolution& solution) {
  // z = x^2, xy, y^2, x^3, x^2 y, x y^2, y^3 with x and y from -1 to 1.
  Eigen::MatrixXd shapes = Eigen::MatrixXd::Zero(3 * board.CornerCount(), 7);
  const Eigen::Vector3d middle = MiddleOf(board), last = board.Corner(board.CornerCount() - 1);
  for (int id = 0; id < board.CornerCount(); ++id) {
    const Eigen::Vector3d place = board.Corner(id) - middle;
    const double x = place.x() / (last - middle).x(), y = place.y() / (last - middle).y();
    shapes.row(3 * id + 2) << x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y;
  }
  return TestSharedPattern(solution, [&](const FrameRows& frame) {
    Eigen::MatrixXd columns(frame.residuals.size(), shapes.cols());
    for (size_t i = 0; i < frame.origins.size(); ++i) {
      columns.middleRows<2>(2 * static_cast<long>(i)) =
          ByCorner(board, solution, frame, i) * shapes.middleRows<3>(3 * IdOf(solution, frame, i));
    }
    return columns;
  });
}

PatternTest TestRollingShutter(const Board& board, const RigSolution& solution) {
  const auto shutter = [&](const FrameRows& frame) {
    Eigen::MatrixXd columns = frame.by_motion;
    for (size_t i = 0; i < frame.origins.size(); ++i) {
      const double height = solution.rig.cameras[CameraOf(solution, frame, i)].camera.height_px;
      columns.middleRows<2>(2 * static_cast<long>(i)) *=
          PixelOf(solution, frame, i).y() / height - 0.5;
    }
    return columns;
  };
  const std::vector<int> place = SomeCorners(board.CornerCount(), kMaxCornersOfShutter);
  const long count = 3 * std::min(board.CornerCount(), kMaxCornersOfShutter);
  const auto corners_elsewhere = [&](const FrameRows& frame) {
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(frame.residuals.size(), count);
    for (size_t i = 0; i < frame.origins.size(); ++i) {
      const int at = place[static_cast<size_t>(IdOf(solution, frame, i))];
      columns.block<2, 3>(2 * static_cast<long>(i), 3 * at) = ByCorner(board, solution, frame, i);
    }
    return columns;
  };
  return TestFramePattern(RowsOfCorners(solution, place), shutter, corners_elsewhere);
}

namespace {

// How the pixels of a frame follow a delay of each camera but the first, per frame of time; the
// board's speed from the frames before and after. Zero where there is none.
PatternColumns ColumnsOfDelays(const RigSolution& solution) {
  std::vector<const FrameRows*> by_frame(solution.rig.rig_from_board.size(), nullptr);
  for (const FrameRows& frame : solution.rows) by_frame[frame.frame] = &frame;
  const auto cameras = static_cast<long>(solution.rig.cameras.size());
  return [&solution, by_frame, cameras](const FrameRows& frame) {
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(frame.residuals.size(), cameras - 1);
    const size_t f = frame.frame;
    if (f == 0 || f + 1 >= by_frame.size() || !by_frame[f - 1] || !by_frame[f + 1]) return columns;
    const auto& poses = solution.rig.rig_from_board;
    const Eigen::AngleAxisd turn(poses[f + 1].rotation * poses[f - 1].rotation.conjugate());
    Eigen::Matrix<double, 6, 1> speed;  // per frame
    speed << 0.5 * turn.angle() * turn.axis(),
        (by_frame[f + 1]->middle_in_rig - by_frame[f - 1]->middle_in_rig) / (2 * frame.distance);
    for (size_t i = 0; i < frame.origins.size(); ++i) {
      const size_t camera = CameraOf(solution, frame, i);
      if (camera == 0) continue;
      const long at = 2 * static_cast<long>(i);
      // Residuals are predicted less observed: an image that is late shows the board ahead.
      columns.block<2, 1>(at, static_cast<long>(camera) - 1) =
          -frame.by_motion.middleRows<2>(at) * speed;
    }
    return columns;
  };
}

}  // namespace

PatternTest TestTimeOffset(const RigSolution& solution) {
  if (solution.rig.cameras.size() < 2) return {};
  return TestSharedPattern(solution, ColumnsOfDelays(solution));
}

PatternTest TestUnsteadyClocks(const RigSolution& solution) {
  if (solution.rig.cameras.size() < 2) return {};
  const PatternColumns delays = ColumnsOfDelays(solution);
  return TestFramePattern(solution.rows, delays, delays);
}

}  // namespace dtr::calib
