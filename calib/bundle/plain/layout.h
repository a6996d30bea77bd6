// calib/bundle/plain/layout.h -- internal to calib/bundle/plain: where the unknowns of cameras and
// lenses stand in the reduced normal equations.
#pragma once
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "calib/bundle/plain/problem.h"

namespace dtr::calib::plain {

/// How the reduced system is solved: by Cholesky's factorisation, dense or sparse, or, where that
/// and its blocks would take longer, by conjugate gradients.
enum class Solution { kDense, kSparse, kIterative };

/// The reduced system consists of nodes: the images, then the lenses. Of two nodes that a point
/// connects there is a block, the lower node's unknowns down, the higher's across, row-major;
/// lenses' sides are padded to kMaxFree. Only blocks of lower-or-equal, higher are stored; of a
/// system that is solved iteratively only a node's own and those of an image with its lens.
class Layout {
 public:
  explicit Layout(const Problem& problem);

  int camera_size() const { return camera_size_; }  ///< 0, 6, or 8: turn, shift, principal point
  bool lenses_move() const { return lenses_move_; }
  size_t nodes() const { return size_.size(); }
  size_t LensNode(size_t lens) const { return images_ + lens; }
  bool IsLens(size_t node) const { return node >= images_; }
  int size(size_t node) const { return size_[node]; }
  int width(size_t node) const { return IsLens(node) ? kMaxFree : camera_size_; }
  long unknowns() const { return unknowns_; }
  long offset(size_t node) const { return offset_[node]; }  ///< in the order of elimination
  Solution solution() const { return solution_; }

  /// Every block: its two nodes and where it begins.
  struct Block {
    std::uint32_t low, high;
    size_t begin;
  };
  const std::vector<Block>& blocks() const { return blocks_; }
  size_t storage() const { return storage_; }
  /// Requires that a point connects them, and low <= high.
  size_t Begin(size_t low, size_t high) const;

 private:
  using Neighbours = std::vector<std::vector<std::uint32_t>>;
  Neighbours NeighboursOf(const Problem& problem) const;
  Neighbours NeighboursWithoutPoints(const Problem& problem) const;
  void StoreBlocks(const Neighbours& above);
  void Choose(const Problem& problem, const Neighbours& above);

  size_t images_ = 0;
  int camera_size_ = 0;
  bool lenses_move_ = false;
  Solution solution_ = Solution::kDense;
  std::vector<int> size_;
  std::vector<long> offset_;
  long unknowns_ = 0;
  std::vector<Block> blocks_;
  std::vector<size_t> row_;           ///< first block of each low node
  std::vector<std::uint32_t> table_;  ///< of few nodes: the block of every pair
  size_t storage_ = 0;
};

}  // namespace dtr::calib::plain
