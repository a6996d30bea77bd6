#include "calib/bundle/plain/iterative.h"

#include <Eigen/Cholesky>
#include <vector>

#include "calib/solve/conjugate_gradients.h"
#include "dtr/base/parallel_for.h"

namespace dtr::calib::plain {
namespace {

using Eigen::VectorXd;

constexpr int kParts = 16;  // of the points, summed in their order
constexpr ConjugateGradientsOptions kOptions{.gain = 0.1, .max_iterations = 500};

template <int kCamera>
class SchurComplement {
 public:
  SchurComplement(const Problem& problem, const Layout& layout, const NormalEquations& normal)
      : problem_(problem),
        layout_(layout),
        normal_(normal),
        sums_(kParts, VectorXd(layout.unknowns())) {}

  VectorXd Times(const VectorXd& x) {
    ParallelFor(0, kParts, [&](int part) {
      VectorXd& sum = sums_[static_cast<size_t>(part)];
      sum.setZero();
      const size_t points = problem_.points(), k = static_cast<size_t>(part);
      for (size_t p = k * points / kParts; p < (k + 1) * points / kParts; ++p) AddPoint(p, x, sum);
    });
    VectorXd y = TimesBlocks(x);
    for (const VectorXd& sum : sums_) y -= sum;
    return y;
  }

  /// Inverts every node's own block; false where one is not positive definite.
  bool Invert() {
    std::vector<Eigen::MatrixXd> own;
    for (size_t node = 0; node < layout_.nodes(); ++node) own.push_back(OwnBlock(node));
    for (size_t i = 0; i < problem_.seen().size(); ++i) {
      const auto image = static_cast<size_t>(problem_.seen()[i].image);
      const CameraMap cross(normal_.CameraCross(i));
      own[image].noalias() -= cross * cross.transpose();
      const double* const lens_cross = normal_.LensCross(i);
      if (lens_cross == nullptr) continue;
      const size_t node = layout_.LensNode(problem_.LensOf(image));
      const auto of_lens = LensMap(lens_cross).topRows(layout_.size(node));
      own[node].noalias() -= of_lens * of_lens.transpose();
    }
    for (const Eigen::MatrixXd& block : own) {
      inverse_.emplace_back(block);
      if (block.size() > 0 && inverse_.back().info() != Eigen::Success) return false;
    }
    return true;
  }

  VectorXd Precondition(const VectorXd& x) const {
    VectorXd y(x.size());
    for (size_t node = 0; node < layout_.nodes(); ++node) {
      const long at = layout_.offset(node), size = layout_.size(node);
      if (size > 0) y.segment(at, size) = inverse_[node].solve(x.segment(at, size));
    }
    return y;
  }

 private:
  using CameraMap = Eigen::Map<const Eigen::Matrix<double, kCamera, 3>>;
  using LensMap = Eigen::Map<const Eigen::Matrix<double, kMaxFree, 3>>;
  using BlockMap = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;  // transposed

  // Adds A A^T x over the nodes of a point.
  void AddPoint(size_t point, const VectorXd& x, VectorXd& sum) const {
    Eigen::Vector3d white = Eigen::Vector3d::Zero();
    const auto for_each = [&](const auto& of_image, const auto& of_lens) {
      for (size_t i = problem_.first(point); i < problem_.first(point + 1); ++i) {
        const auto image = static_cast<size_t>(problem_.seen()[i].image);
        of_image(CameraMap(normal_.CameraCross(i)), layout_.offset(image));
        const double* const cross = normal_.LensCross(i);
        if (cross == nullptr) continue;
        const size_t node = layout_.LensNode(problem_.LensOf(image));
        of_lens(LensMap(cross).topRows(layout_.size(node)), layout_.offset(node));
      }
    };
    for_each([&](const CameraMap& a,
                 long at) { white.noalias() += a.transpose() * x.template segment<kCamera>(at); },
             [&](const auto& a, long at) {
               white.noalias() += a.transpose() * x.segment(at, a.rows());
             });
    for_each([&](const CameraMap& a,
                 long at) { sum.template segment<kCamera>(at).noalias() += a * white; },
             [&](const auto& a, long at) { sum.segment(at, a.rows()).noalias() += a * white; });
  }

  BlockMap Transposed(const Layout::Block& block) const {
    return {normal_.blocks().data() + block.begin, layout_.size(block.high),
            layout_.size(block.low), Eigen::OuterStride<>(layout_.width(block.high))};
  }

  Eigen::MatrixXd OwnBlock(size_t node) const {
    const BlockMap block =
        Transposed({static_cast<std::uint32_t>(node), static_cast<std::uint32_t>(node),
                    layout_.Begin(node, node)});
    return block.transpose();
  }

  VectorXd TimesBlocks(const VectorXd& x) const {
    VectorXd y = VectorXd::Zero(x.size());
    for (const Layout::Block& block : layout_.blocks()) {
      const BlockMap b = Transposed(block);
      const long low = layout_.offset(block.low), high = layout_.offset(block.high);
      y.segment(low, b.cols()).noalias() += b.transpose() * x.segment(high, b.rows());
      if (block.low == block.high) continue;
      y.segment(high, b.rows()).noalias() += b * x.segment(low, b.cols());
    }
    return y;
  }

  const Problem& problem_;
  const Layout& layout_;
  const NormalEquations& normal_;
  std::vector<VectorXd> sums_;
  std::vector<Eigen::LLT<Eigen::MatrixXd>> inverse_;
};

template <int kCamera>
std::optional<VectorXd> SolveOf(const Problem& problem, const Layout& layout,
                                const NormalEquations& normal) {
  SchurComplement<kCamera> schur(problem, layout, normal);
  if (!schur.Invert()) return {};
  return ConjugateGradients(
      normal.right(), kOptions, [&](const VectorXd& x) { return schur.Times(x); },
      [&](const VectorXd& x) { return schur.Precondition(x); });
}

}  // namespace

std::optional<VectorXd> SolveIteratively(const Problem& problem, const Layout& layout,
                                         const NormalEquations& normal) {
  return layout.camera_size() == 8 ? SolveOf<8>(problem, layout, normal)
                                   : SolveOf<6>(problem, layout, normal);
}

}  // namespace dtr::calib::plain
