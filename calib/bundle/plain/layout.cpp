#include "calib/bundle/plain/layout.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>

namespace dtr::calib::plain {
namespace {

constexpr size_t kTableNodes = 2048;  // up to here pairs are looked up in a table: 16 MB
constexpr long kAlwaysDense = 600;    // unknowns: a dense factorisation takes some 20 ms
constexpr long kNeverDense = 8000;    // 512 MB
constexpr double kSparseShare = 0.3;  // of all pairs of nodes that have a block

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

// Nodes above each that a point connects it with, itself first.
std::vector<std::vector<std::uint32_t>> Neighbours(const Problem& problem, const Layout& layout) {
  std::vector<std::vector<std::uint32_t>> above(layout.nodes());
  std::vector<size_t> tidy(layout.nodes(), 64);  // length at which duplicates are removed
  std::vector<std::uint32_t> nodes;
  for (size_t p = 0; p < problem.points(); ++p) {
    NodesOfPoint(problem, layout, p, nodes);
    for (size_t a = 0; a < nodes.size(); ++a) {
      auto& row = above[nodes[a]];
      row.insert(row.end(), nodes.begin() + static_cast<long>(a), nodes.end());
      if (row.size() < tidy[nodes[a]]) continue;
      SortUnique(row);
      tidy[nodes[a]] = std::max<size_t>(64, 2 * row.size());
    }
  }
  for (size_t a = 0; a < above.size(); ++a) {
    above[a].push_back(static_cast<std::uint32_t>(a));  // every node has its own block
    SortUnique(above[a]);
  }
  return above;
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
  FindBlocks(problem);
  OrderNodes();
}

void Layout::FindBlocks(const Problem& problem) {
  const auto above = Neighbours(problem, *this);
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

void Layout::OrderNodes() {
  for (const int size : size_) unknowns_ += size;
  const auto all = static_cast<double>(nodes());
  const double share = static_cast<double>(blocks_.size()) / (0.5 * all * (all + 1));
  sparse_ = unknowns_ > kNeverDense || (unknowns_ > kAlwaysDense && share < kSparseShare);
  std::vector<int> order(nodes());
  for (size_t k = 0; k < order.size(); ++k) order[k] = static_cast<int>(k);
  if (sparse_) {
    std::vector<Eigen::Triplet<double>> entries;
    for (const Block& block : blocks_) {
      const int low = static_cast<int>(block.low), high = static_cast<int>(block.high);
      entries.emplace_back(low, high, 1.0);
      if (low != high) entries.emplace_back(high, low, 1.0);
    }
    const auto side = static_cast<int>(nodes());
    Eigen::SparseMatrix<double> graph(side, side);
    graph.setFromTriplets(entries.begin(), entries.end());
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> eliminated;
    Eigen::AMDOrdering<int>()(graph, eliminated);
    for (int k = 0; k < side; ++k) order[static_cast<size_t>(k)] = eliminated.indices()[k];
  }
  offset_.assign(nodes(), 0);
  long next = 0;
  for (const int node : order) {
    offset_[static_cast<size_t>(node)] = next;
    next += size_[static_cast<size_t>(node)];
  }
}

}  // namespace dtr::calib::plain
