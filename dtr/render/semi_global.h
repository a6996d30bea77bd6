// dtr/render/semi_global.h -- one label for each cell of a grid, cheap and smooth.
#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

#include "dtr/base/parallel_for.h"

namespace dtr {

/// Semi-global matching along rows and columns, both ways (Hirschmueller 2008, eq. 13).
class SemiGlobal {
 public:
  SemiGlobal(int columns, int rows, size_t labels)
      : columns_(columns),
        rows_(rows),
        labels_(labels),
        costs_(static_cast<size_t>(columns) * static_cast<size_t>(rows) * labels),
        sums_(costs_.size()) {}

  /// A cell's costs, by label: to be filled in before Solve.
  float* CostsOf(int x, int y) { return &costs_[At(x, y)]; }
  /// After Solve: costs summed over all paths to the cell, by label.
  const float* SumsOf(int x, int y) const { return &sums_[At(x, y)]; }
  int Best(int x, int y) const {
    const float* sums = SumsOf(x, y);
    return static_cast<int>(std::min_element(sums, sums + labels_) - sums);
  }

  /// `cheapest(before, least, label)` is the least cost of coming to `label` from a cell with these
  /// path costs, of which `least` is the smallest. Does not depend on the number of threads.
  template <typename Cheapest>
  void Solve(int threads, const Cheapest& cheapest) {
    ParallelFor(0, rows_, threads, [&](int y) {
      Follow(0, y, 1, 0, cheapest);
      Follow(columns_ - 1, y, -1, 0, cheapest);
    });
    ParallelFor(0, columns_, threads, [&](int x) {
      Follow(x, 0, 0, 1, cheapest);
      Follow(x, rows_ - 1, 0, -1, cheapest);
    });
  }

 private:
  size_t At(int x, int y) const {
    return (static_cast<size_t>(y) * static_cast<size_t>(columns_) + static_cast<size_t>(x)) *
           labels_;
  }

  /// One path from a border cell.
  template <typename Cheapest>
  void Follow(int x, int y, int dx, int dy, const Cheapest& cheapest) {
    std::vector<float> before(labels_, 0), now(labels_);
    for (; x >= 0 && y >= 0 && x < columns_ && y < rows_; x += dx, y += dy) {
      const float least = *std::min_element(before.begin(), before.end());
      const size_t at = At(x, y);
      for (size_t label = 0; label < labels_; ++label) {
        now[label] = costs_[at + label] + cheapest(before.data(), least, label) - least;
        sums_[at + label] += now[label];
      }
      std::swap(before, now);
    }
  }

  const int columns_, rows_;
  const size_t labels_;
  std::vector<float> costs_, sums_;  ///< per cell and label
};

}  // namespace dtr
