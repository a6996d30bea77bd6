#include "calib/bundle/plain/layout.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <numeric>

namespace dtr::calib::plain {
namespace {

constexpr size_t kTableNodes = 2048;  // up to here pairs are looked up in a table: 16 MB
constexpr long kAlwaysDense = 600;    // unknowns: a dense factorisation takes some 20 ms
// What solutions cost, in multiplications of a sparse factorisation: dense ones, and a point's
// blocks, run so many times as fast; conjugate gradients take so many products with an
// observation's block.
constexpr double kDenseSpeed = 8, kBlockSpeed = 3, kProducts = 80;

// The nodes of a point's observations: images, then lenses; each once, rising.
void NodesOfPoint(const Problem& problem, const Layout& layout, size_t point,
                  std::vector<std::uint32_t>& nodes) {
  nodes.clear();
  for (size_t i = problem.first(point); i < problem.first(point + 1); ++i) {
    const auto image = static_cast<size_t>(problem.seen()[i].image);
    if (layout.camera_size() > 0) nodes.push_back(static_cast<std::uint32_t>(image));
    if (layout.lenses_move()) {
      nodes.push_back(static_cast<std::uint32_t>(layout.LensNode(problem.LensOf(image))));
    }
  }
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
}

void SortUnique(std::vector<std::uint32_t>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

// In the order of elimination: multiplications of a sparse factorisation. `graph`: both triangles.
// The symbolic part of Davis 2005 (LDL, sec. 2): row by row the columns that it fills.
double SparseWork(const Eigen::SparseMatrix<double>& graph, const std::vector<int>& order,
                  const Layout& layout) {
  const size_t count = order.size();
  std::vector<size_t> place(count), parent(count, count), mark(count, count);
  std::vector<double> below(count);  // unknowns of the rows that a column fills
  for (size_t k = 0; k < count; ++k) place[static_cast<size_t>(order[k])] = k;
  for (size_t k = 0; k < count; ++k) {
    mark[k] = k;
    for (Eigen::SparseMatrix<double>::InnerIterator it(graph, order[k]); it; ++it) {
      for (size_t i = place[static_cast<size_t>(it.row())]; i < k && mark[i] != k; i = parent[i]) {
        if (parent[i] == count) parent[i] = k;
        below[i] += layout.size(static_cast<size_t>(order[k]));
        mark[i] = k;
      }
    }
  }
  double work = 0;
  for (size_t k = 0; k < count; ++k) {
    work += layout.size(static_cast<size_t>(order[k])) * below[k] * below[k];
  }
  return work;
}

// The order of elimination that fills little (approximate minimum degree), and its SparseWork.
double OrderSparsely(const std::vector<std::vector<std::uint32_t>>& above, const Layout& layout,
                     std::vector<int>& order) {
  std::vector<Eigen::Triplet<double>> entries;
  for (size_t low = 0; low < above.size(); ++low) {
    for (const std::uint32_t high : above[low]) {
      entries.emplace_back(static_cast<int>(low), static_cast<int>(high), 1.0);
      if (low != high) entries.emplace_back(static_cast<int>(high), static_cast<int>(low), 1.0);
    }
  }
  const auto side = static_cast<int>(above.size());
  Eigen::SparseMatrix<double> graph(side, side);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> eliminated;
  Eigen::AMDOrdering<int>()(graph, eliminated);
  order.assign(eliminated.indices().data(), eliminated.indices().data() + side);
  return SparseWork(graph, order, layout);
}

}  // namespace

Layout::Layout(const Problem& problem) : images_(problem.images()) {
  const Settings& settings = problem.settings();
  if (settings.free_poses) camera_size_ = problem.n().shift.empty() ? 6 : 8;
  size_.assign(images_, camera_size_);
  for (const auto& free : settings.free_params) {
    size_.push_back(static_cast<int>(free.size()));
    lenses_move_ = lenses_move_ || !free.empty();
  }
  for (const int size : size_) unknowns_ += size;
  const Neighbours above = NeighboursOf(problem);
  Choose(problem, above);
  StoreBlocks(solution_ == Solution::kIterative ? NeighboursWithoutPoints(problem) : above);
}

// Nodes above each that a point connects it with, itself first.
Layout::Neighbours Layout::NeighboursOf(const Problem& problem) const {
  Neighbours above(nodes());
  std::vector<size_t> tidy(nodes(), 64);  // length at which duplicates are removed
  std::vector<std::uint32_t> of_point;
  for (size_t p = 0; p < problem.points(); ++p) {
    NodesOfPoint(problem, *this, p, of_point);
    for (size_t a = 0; a < of_point.size(); ++a) {
      auto& row = above[of_point[a]];
      row.insert(row.end(), of_point.begin() + static_cast<long>(a), of_point.end());
      if (row.size() < tidy[of_point[a]]) continue;
      SortUnique(row);
      tidy[of_point[a]] = std::max<size_t>(64, 2 * row.size());
    }
  }
  for (size_t a = 0; a < above.size(); ++a) {
    above[a].push_back(static_cast<std::uint32_t>(a));  // every node has its own block
    SortUnique(above[a]);
  }
  return above;
}

Layout::Neighbours Layout::NeighboursWithoutPoints(const Problem& problem) const {
  Neighbours above(nodes());
  for (size_t a = 0; a < nodes(); ++a) {
    above[a].push_back(static_cast<std::uint32_t>(a));
    if (!IsLens(a) && lenses_move_) {
      above[a].push_back(static_cast<std::uint32_t>(LensNode(problem.LensOf(a))));
    }
  }
  return above;
}

void Layout::StoreBlocks(const Neighbours& above) {
  row_.assign(nodes() + 1, 0);
  for (size_t a = 0; a < nodes(); ++a) {
    row_[a] = blocks_.size();
    for (const std::uint32_t b : above[a]) {
      blocks_.push_back({static_cast<std::uint32_t>(a), b, storage_});
      storage_ += static_cast<size_t>(width(a)) * static_cast<size_t>(width(b));
    }
  }
  row_[nodes()] = blocks_.size();
  if (nodes() > kTableNodes) return;
  table_.assign(nodes() * nodes(), 0);
  for (size_t k = 0; k < blocks_.size(); ++k) {
    table_[blocks_[k].low * nodes() + blocks_[k].high] = static_cast<std::uint32_t>(k);
  }
}

size_t Layout::Begin(size_t low, size_t high) const {
  if (!table_.empty()) return blocks_[table_[low * nodes() + high]].begin;
  const auto begin = blocks_.begin() + static_cast<long>(row_[low]);
  const auto end = blocks_.begin() + static_cast<long>(row_[low + 1]);
  return std::lower_bound(begin, end, high,
                          [](const Block& block, size_t node) { return block.high < node; })
      ->begin;
}

// The solution, and the order of elimination.
void Layout::Choose(const Problem& problem, const Neighbours& above) {
  std::vector<int> order(nodes());
  std::iota(order.begin(), order.end(), 0);
  if (unknowns_ > kAlwaysDense) {
    const auto side = static_cast<double>(unknowns_);
    const double dense = side * side * side / 3 / kDenseSpeed;
    std::vector<int> sparse_order;
    const double sparse = OrderSparsely(above, *this, sparse_order);
    const double block = camera_size_ * 3.0;
    double blocks = 0;
    for (size_t p = 0; p < problem.points(); ++p) {
      const auto images = static_cast<double>(problem.first(p + 1) - problem.first(p));
      blocks += 0.5 * images * images * block * camera_size_ / kBlockSpeed;
    }
    const double iterative = kProducts * block * static_cast<double>(problem.seen().size());
    if (camera_size_ > 0 && std::min(dense, sparse) + blocks > iterative) {
      solution_ = Solution::kIterative;
    } else if (sparse < dense) {
      solution_ = Solution::kSparse;
      order = std::move(sparse_order);
    }
  }
  offset_.assign(nodes(), 0);
  long next = 0;
  for (const int node : order) {
    offset_[static_cast<size_t>(node)] = next;
    next += size_[static_cast<size_t>(node)];
  }
}

}  // namespace dtr::calib::plain
