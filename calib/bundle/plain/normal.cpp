#include "calib/bundle/plain/normal.h"

#include <algorithm>
#include <cmath>

#include "dtr/base/parallel_for.h"

namespace dtr::calib::plain {
namespace {

constexpr size_t kPartObservations = 8192;  // that one part sums up at least
constexpr size_t kMaxParts = 16;
constexpr size_t kMaxPartNumbers = size_t{1} << 25;  // 256 MB in all parts
// Of a point's damping: an inverse distance that no observation determines is damped as if it had
// this share of the curvature of the cost along the point's direction.
constexpr double kMinDistanceShare = 1e-6;

size_t PartsOf(size_t observations, size_t storage) {
  const size_t by_work = observations / kPartObservations;
  const size_t by_memory = kMaxPartNumbers / std::max<size_t>(1, storage);
  return std::clamp<size_t>(std::min(by_work, by_memory), 1, kMaxParts);
}

template <int kRows, int kColumns>
void SubtractOuter(const double* a, const double* b, double* block) {
  for (int i = 0; i < kRows; ++i) {
    const double a0 = a[i], a1 = a[kRows + i], a2 = a[2 * kRows + i];
    for (int j = 0; j < kColumns; ++j) {
      block[i * kColumns + j] -= a0 * b[j] + a1 * b[kColumns + j] + a2 * b[2 * kColumns + j];
    }
  }
}

template <int kRows, int kColumns>
void AddOuter(const double* a, const double* b, double* block) {
  for (int i = 0; i < kRows; ++i) {
    for (int j = 0; j < kColumns; ++j) {
      block[i * kColumns + j] += a[i] * b[j] + a[kRows + i] * b[kColumns + j];
    }
  }
}

// a (2 rows of kRows)^T b (2 rows of 3), as three columns.
template <int kRows>
void Cross(const double* a, const double* b, double* columns) {
  for (int c = 0; c < 3; ++c) {
    for (int i = 0; i < kRows; ++i) {
      columns[c * kRows + i] += a[i] * b[c] + a[kRows + i] * b[3 + c];
    }
  }
}

}  // namespace

// Two rows of the weighted derivatives, and the residual. Of a lens the free parameters only.
template <int kCamera>
struct NormalEquations::Row {
  double camera[2 * std::max(kCamera, 1)];
  double lens[2 * kMaxFree];
  double point[6];
  double residual[2];
  size_t image, lens_of, lens_slot;
};

// The sums over some of the points.
template <int kCamera>
class NormalEquations::Part {
 public:
  Part(NormalEquations& all, const std::vector<Camera>& cameras,
       const std::vector<Intrinsics>& lenses, double lambda, Sums& sums)
      : all_(all),
        problem_(all.problem_),
        layout_(all.layout_),
        cameras_(cameras),
        lenses_(lenses),
        lambda_(lambda),
        eliminates_(layout_.solution() != Solution::kIterative),
        sums_(sums) {
    std::fill(sums_.blocks.begin(), sums_.blocks.end(), 0.0);
    sums_.right.setZero(), sums_.gradient.setZero(), sums_.diagonal.setZero();
  }

  void Add(size_t point, const std::array<double, 3>& place) {
    const size_t first = problem_.first(point), count = problem_.first(point + 1) - first;
    rows_.resize(count);
    const PointAt at(problem_.n().points[point], place);
    for (size_t i = 0; i < count; ++i) MakeRow(problem_.seen()[first + i], point, at, rows_[i]);
    EliminatedPoint& eliminated = all_.points_[point];
    Eliminate(eliminated);
    FindLenses(first);
    AddCrossTerms(first, eliminated);
    AddBlocks(first, eliminated);
  }

 private:
  void MakeRow(const Seen& seen, size_t point, const PointAt& at, Row<kCamera>& row) const {
    row.image = static_cast<size_t>(seen.image);
    const Camera& camera = cameras_[row.image];
    row.lens_of = camera.lens;
    const PointFrame& frame = problem_.n().points[point];
    const Eigen::Vector3d offset = frame.anchor - camera.centre;
    const Eigen::Vector3d p = camera.rotation * (at.direction + at.rho * offset);
    double pixel[2], by_lens[2 * kColumns];
    Eigen::Matrix<double, 2, 3, Eigen::RowMajor> by_p;
    // Only reached at unknowns whose cost was finite: every point has its pixel.
    Differentiate(lenses_[row.lens_of], p.data(), pixel, by_p.data(), by_lens);
    const double r[2] = {pixel[0] + camera.shift_px[0] - seen.pixel[0],
                         pixel[1] + camera.shift_px[1] - seen.pixel[1]};
    const Eigen::Matrix<double, 2, 3, Eigen::RowMajor> by_world = by_p * camera.rotation;
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector3d of = by_world.row(k);
      row.point[3 * k] = of.dot(frame.e1);
      row.point[3 * k + 1] = of.dot(frame.e2);
      row.point[3 * k + 2] = of.dot(offset);
    }
    if constexpr (kCamera > 0) ByCamera(by_p, by_world, p, at.rho, row);
    if (layout_.lenses_move()) ByLens(by_lens, row);
    Weigh(r, row);
  }

  void ByCamera(const Eigen::Matrix<double, 2, 3, Eigen::RowMajor>& by_p,
                const Eigen::Matrix<double, 2, 3, Eigen::RowMajor>& by_world,
                const Eigen::Vector3d& p, double rho, Row<kCamera>& row) const {
    const double moves = problem_.PoseMoves(row.image) ? 1 : 0;
    for (int k = 0; k < 2; ++k) {
      double* out = row.camera + k * kCamera;
      // A turn w of the camera moves p by w x p.
      out[0] = moves * (by_p(k, 2) * p[1] - by_p(k, 1) * p[2]);
      out[1] = moves * (by_p(k, 0) * p[2] - by_p(k, 2) * p[0]);
      out[2] = moves * (by_p(k, 1) * p[0] - by_p(k, 0) * p[1]);
      for (int c = 0; c < 3; ++c) out[3 + c] = -moves * rho * by_world(k, c);
      if constexpr (kCamera == 8) {
        const double scale = problem_.ShiftScale(row.image);
        out[6] = k == 0 ? scale : 0;
        out[7] = k == 1 ? scale : 0;
      }
    }
  }

  void ByLens(const double* by_lens, Row<kCamera>& row) const {
    const LensFrame& lens = problem_.n().lenses[row.lens_of];
    const std::vector<int>& free = problem_.settings().free_params[row.lens_of];
    std::fill(row.lens, row.lens + 2 * kMaxFree, 0.0);
    for (size_t i = 0; i < free.size(); ++i) {
      const Column column = ColumnOf(lens.model, free[i]);
      const double scale = lens.scale[static_cast<size_t>(free[i])];
      row.lens[i] = scale * by_lens[2 * column];
      row.lens[kMaxFree + i] = scale * by_lens[2 * column + 1];
    }
  }

  void Weigh(const double r[2], Row<kCamera>& row) const {
    row.residual[0] = r[0], row.residual[1] = r[1];
    if (!(problem_.loss().scale2 > 0)) return;
    const double weight = std::sqrt(problem_.loss().Slope(r[0] * r[0] + r[1] * r[1]));
    const auto weigh = [weight](double* values, int count) {
      for (int i = 0; i < count; ++i) values[i] *= weight;
    };
    weigh(row.camera, 2 * kCamera);
    if (layout_.lenses_move()) weigh(row.lens, 2 * kMaxFree);
    weigh(row.point, 6);
    weigh(row.residual, 2);
  }

  void Eliminate(EliminatedPoint& e) const {
    double v[6] = {}, *g = e.gradient;  // v: 00 10 20 11 21 22
    g[0] = g[1] = g[2] = 0;
    for (const Row<kCamera>& row : rows_) {
      const double *a = row.point, *b = row.point + 3;
      v[0] += a[0] * a[0] + b[0] * b[0];
      v[1] += a[1] * a[0] + b[1] * b[0];
      v[2] += a[2] * a[0] + b[2] * b[0];
      v[3] += a[1] * a[1] + b[1] * b[1];
      v[4] += a[2] * a[1] + b[2] * b[1];
      v[5] += a[2] * a[2] + b[2] * b[2];
      for (int c = 0; c < 3; ++c) g[c] += a[c] * row.residual[0] + b[c] * row.residual[1];
    }
    const double floor = kMinDistanceShare * (v[0] + v[3]);
    e.damping[0] = lambda_ * v[0];
    e.damping[1] = lambda_ * v[3];
    e.damping[2] = lambda_ * std::max(v[5], floor);
    const double tiny = 1e-300;  // no observation: no step
    e.inverse_pivots[0] = 1 / std::sqrt(std::max(v[0] + e.damping[0], tiny));
    e.l10 = v[1] * e.inverse_pivots[0];
    e.l20 = v[2] * e.inverse_pivots[0];
    const double second = v[3] + e.damping[1] - e.l10 * e.l10;
    e.inverse_pivots[1] = 1 / std::sqrt(std::max(second, std::max(e.damping[1], tiny)));
    e.l21 = (v[4] - e.l20 * e.l10) * e.inverse_pivots[1];
    const double third = v[5] + e.damping[2] - e.l20 * e.l20 - e.l21 * e.l21;
    e.inverse_pivots[2] = 1 / std::sqrt(std::max(third, std::max(e.damping[2], tiny)));
    Whiten(e, g, e.white);
  }

  static void Whiten(const EliminatedPoint& e, const double* x, double* white) {
    white[0] = x[0] * e.inverse_pivots[0];
    white[1] = (x[1] - e.l10 * white[0]) * e.inverse_pivots[1];
    white[2] = (x[2] - e.l20 * white[0] - e.l21 * white[1]) * e.inverse_pivots[2];
  }

  // The lenses that the point is seen through, each with the observation that comes first.
  void FindLenses(size_t first) {
    slots_.clear();
    for (size_t i = 0; i < rows_.size(); ++i) {
      size_t s = 0;
      while (s < slots_.size() && rows_[slots_[s]].lens_of != rows_[i].lens_of) ++s;
      all_.lens_first_[first + i] = s == slots_.size();
      if (s == slots_.size()) slots_.push_back(i);
      rows_[i].lens_slot = s;
    }
  }

  double* CameraCross(size_t observation) const {
    return all_.camera_cross_.data() + observation * 3 * kCamera;
  }
  double* LensCross(size_t observation) const {
    return all_.lens_cross_.data() + observation * 3 * kMaxFree;
  }

  void AddCrossTerms(size_t first, const EliminatedPoint& e) {
    const bool lenses = layout_.lenses_move();
    for (const size_t slot : slots_) {
      if (lenses) std::fill_n(LensCross(first + slot), 3 * kMaxFree, 0.0);
    }
    for (size_t i = 0; i < rows_.size(); ++i) {
      const Row<kCamera>& row = rows_[i];
      double white[6];
      Whiten(e, row.point, white);
      Whiten(e, row.point + 3, white + 3);
      if constexpr (kCamera > 0) {
        std::fill_n(CameraCross(first + i), 3 * kCamera, 0.0);
        Cross<kCamera>(row.camera, white, CameraCross(first + i));
      }
      if (lenses) Cross<kMaxFree>(row.lens, white, LensCross(first + slots_[row.lens_slot]));
    }
  }

  void AddBlocks(size_t first, const EliminatedPoint& e) {
    if constexpr (kCamera > 0) {
      for (size_t i = 0; i < rows_.size(); ++i) AddImage(first, i, e);
    }
    if (!layout_.lenses_move()) return;
    for (size_t s = 0; s < slots_.size(); ++s) AddLens(first, s, e);
    for (const Row<kCamera>& row : rows_) AddLensRow(row);
  }

  void AddImage(size_t first, size_t i, const EliminatedPoint& e) {
    const Row<kCamera>& row = rows_[i];
    double* const blocks = sums_.blocks.data();
    const double* const cross = CameraCross(first + i);
    AddOuter<kCamera, kCamera>(row.camera, row.camera,
                               blocks + layout_.Begin(row.image, row.image));
    for (size_t j = i; j < rows_.size() && eliminates_; ++j) {
      double* const block = blocks + layout_.Begin(row.image, rows_[j].image);
      SubtractOuter<kCamera, kCamera>(cross, CameraCross(first + j), block);
      // An image that sees the point twice.
      if (j > i && rows_[j].image == row.image) {
        SubtractOuter<kCamera, kCamera>(CameraCross(first + j), cross, block);
      }
    }
    if (layout_.lenses_move()) {
      AddOuter<kCamera, kMaxFree>(row.camera, row.lens,
                                  blocks + layout_.Begin(row.image, layout_.LensNode(row.lens_of)));
      for (const size_t slot : slots_) {
        if (!eliminates_) break;
        SubtractOuter<kCamera, kMaxFree>(
            cross, LensCross(first + slot),
            blocks + layout_.Begin(row.image, layout_.LensNode(rows_[slot].lens_of)));
      }
    }
    const long at = layout_.offset(row.image);
    for (int k = 0; k < kCamera; ++k) {
      const double a = row.camera[k], b = row.camera[kCamera + k];
      const double gradient = a * row.residual[0] + b * row.residual[1];
      sums_.gradient[at + k] += gradient;
      sums_.right[at + k] -= gradient - (cross[k] * e.white[0] + cross[kCamera + k] * e.white[1] +
                                         cross[2 * kCamera + k] * e.white[2]);
      sums_.diagonal[at + k] += a * a + b * b;
    }
  }

  void AddLens(size_t first, size_t s, const EliminatedPoint& e) {
    const size_t node = layout_.LensNode(rows_[slots_[s]].lens_of);
    const double* const cross = LensCross(first + slots_[s]);
    for (const size_t slot : slots_) {
      const size_t other = layout_.LensNode(rows_[slot].lens_of);
      if (other < node || !eliminates_) continue;
      SubtractOuter<kMaxFree, kMaxFree>(cross, LensCross(first + slot),
                                        sums_.blocks.data() + layout_.Begin(node, other));
    }
    const long at = layout_.offset(node);
    for (int k = 0; k < layout_.size(node); ++k) {
      sums_.right[at + k] += cross[k] * e.white[0] + cross[kMaxFree + k] * e.white[1] +
                             cross[2 * kMaxFree + k] * e.white[2];
    }
  }

  void AddLensRow(const Row<kCamera>& row) {
    const size_t node = layout_.LensNode(row.lens_of);
    AddOuter<kMaxFree, kMaxFree>(row.lens, row.lens,
                                 sums_.blocks.data() + layout_.Begin(node, node));
    const long at = layout_.offset(node);
    for (int k = 0; k < layout_.size(node); ++k) {
      const double a = row.lens[k], b = row.lens[kMaxFree + k];
      const double gradient = a * row.residual[0] + b * row.residual[1];
      sums_.gradient[at + k] += gradient;
      sums_.right[at + k] -= gradient;
      sums_.diagonal[at + k] += a * a + b * b;
    }
  }

  NormalEquations& all_;
  const Problem& problem_;
  const Layout& layout_;
  const std::vector<Camera>& cameras_;
  const std::vector<Intrinsics>& lenses_;
  const double lambda_;
  const bool eliminates_;  // the points, from the blocks too
  Sums& sums_;
  std::vector<Row<kCamera>> rows_;
  std::vector<size_t> slots_;
};

NormalEquations::NormalEquations(const Problem& problem, const Layout& layout)
    : problem_(problem), layout_(layout) {
  const size_t observations = problem.seen().size();
  parts_.resize(PartsOf(observations, layout.storage()));
  const auto clear = [&](Sums& sums) {
    sums.blocks.assign(layout.storage(), 0);
    sums.right = sums.gradient = sums.diagonal = Eigen::VectorXd::Zero(layout.unknowns());
  };
  for (Sums& part : parts_) clear(part);
  clear(sum_);
  points_.resize(problem.points());
  camera_cross_.resize(observations * 3 * static_cast<size_t>(layout.camera_size()));
  if (layout.lenses_move()) lens_cross_.resize(observations * 3 * kMaxFree);
  lens_first_.resize(observations);
}

template <int kCamera>
void NormalEquations::BuildOf(const Unknowns& x, double lambda) {
  const std::vector<Camera> cameras = problem_.CamerasAt(x);
  const std::vector<Intrinsics> lenses = problem_.IntrinsicsAt(x);
  const size_t parts = parts_.size(), points = problem_.points();
  ParallelFor(0, static_cast<int>(parts), [&](int part) {
    const auto k = static_cast<size_t>(part);
    Part<kCamera> sums(*this, cameras, lenses, lambda, parts_[k]);
    for (size_t p = k * points / parts; p < (k + 1) * points / parts; ++p) {
      sums.Add(p, x.place[p]);
    }
  });
  sum_ = parts_[0];
  for (size_t k = 1; k < parts; ++k) {
    for (size_t i = 0; i < sum_.blocks.size(); ++i) sum_.blocks[i] += parts_[k].blocks[i];
    sum_.right += parts_[k].right;
    sum_.gradient += parts_[k].gradient;
    sum_.diagonal += parts_[k].diagonal;
  }
}

void NormalEquations::Build(const Unknowns& x, double lambda) {
  switch (layout_.camera_size()) {
    case 6:
      BuildOf<6>(x, lambda);
      break;
    case 8:
      BuildOf<8>(x, lambda);
      break;
    default:
      BuildOf<0>(x, lambda);
  }
  AddPriors(x);
  Damp(lambda);
}

void NormalEquations::AddPriors(const Unknowns& x) {
  for (const LensPrior& prior : problem_.settings().lens_priors) {
    double by_theta[kMaxParams];
    const double residual = problem_.PriorAt(prior, x, by_theta);
    const std::vector<int>& free = problem_.settings().free_params[prior.lens];
    const size_t node = layout_.LensNode(prior.lens);
    double* const block = sum_.blocks.data() + layout_.Begin(node, node);
    const long at = layout_.offset(node);
    for (size_t i = 0; i < free.size(); ++i) {
      const double a = by_theta[free[i]];
      const auto k = at + static_cast<long>(i);
      sum_.gradient[k] += a * residual;
      sum_.right[k] -= a * residual;
      sum_.diagonal[k] += a * a;
      for (size_t j = 0; j < free.size(); ++j) block[i * kMaxFree + j] += a * by_theta[free[j]];
    }
  }
  for (size_t i = 0; i < x.shift.size() && layout_.camera_size() == 8; ++i) {
    double* const block = sum_.blocks.data() + layout_.Begin(i, i);
    const double scale = problem_.ShiftScale(i), weight = problem_.settings().shift_weights[i];
    for (int axis = 0; axis < 2; ++axis) {
      const double a = weight * scale;
      const double residual =
          weight * (problem_.ShiftAtStart(i)[axis] + scale * x.shift[i][static_cast<size_t>(axis)]);
      const long k = layout_.offset(i) + 6 + axis;
      sum_.gradient[k] += a * residual;
      sum_.right[k] -= a * residual;
      sum_.diagonal[k] += a * a;
      block[(6 + axis) * 8 + 6 + axis] += a * a;
    }
  }
}

void NormalEquations::Damp(double lambda) {
  damping_ = lambda * sum_.diagonal;
  for (size_t node = 0; node < layout_.nodes(); ++node) {
    double* const block = sum_.blocks.data() + layout_.Begin(node, node);
    for (int k = 0; k < layout_.size(node); ++k) {
      const long at = layout_.offset(node) + k;
      double& diagonal = block[k * layout_.width(node) + k];
      // What no observation tells stays where it is.
      diagonal = sum_.diagonal[at] > 0 ? diagonal + damping_[at] : 1;
    }
  }
}

template <int kCamera>
void NormalEquations::StepPointsOf(const Eigen::VectorXd& step,
                                   std::vector<std::array<double, 3>>& points,
                                   double* decrease) const {
  for (size_t p = 0; p < problem_.points(); ++p) {
    const EliminatedPoint& e = points_[p];
    double white[3] = {-e.white[0], -e.white[1], -e.white[2]};
    const auto take = [&](const double* cross, int stride, int count, long at) {
      for (int c = 0; c < 3; ++c) {
        for (int k = 0; k < count; ++k) white[c] -= cross[c * stride + k] * step[at + k];
      }
    };
    for (size_t i = problem_.first(p); i < problem_.first(p + 1); ++i) {
      const auto image = static_cast<size_t>(problem_.seen()[i].image);
      take(camera_cross_.data() + i * 3 * kCamera, kCamera, kCamera, layout_.offset(image));
      if (!layout_.lenses_move() || !lens_first_[i]) continue;
      const size_t node = layout_.LensNode(problem_.LensOf(image));
      take(lens_cross_.data() + i * 3 * kMaxFree, kMaxFree, layout_.size(node),
           layout_.offset(node));
    }
    // L^T x = white
    auto& x = points[p];
    x[2] = white[2] * e.inverse_pivots[2];
    x[1] = (white[1] - e.l21 * x[2]) * e.inverse_pivots[1];
    x[0] = (white[0] - e.l10 * x[1] - e.l20 * x[2]) * e.inverse_pivots[0];
    for (size_t c = 0; c < 3; ++c) {
      *decrease += 0.5 * x[c] * (e.damping[c] * x[c] - e.gradient[c]);
    }
  }
}

void NormalEquations::StepPoints(const Eigen::VectorXd& step,
                                 std::vector<std::array<double, 3>>& points,
                                 double* decrease) const {
  points.assign(problem_.points(), {});
  switch (layout_.camera_size()) {
    case 6:
      return StepPointsOf<6>(step, points, decrease);
    case 8:
      return StepPointsOf<8>(step, points, decrease);
    default:
      return StepPointsOf<0>(step, points, decrease);
  }
}

}  // namespace dtr::calib::plain
