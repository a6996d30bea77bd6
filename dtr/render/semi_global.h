// dtr/render/semi_global.h -- one label for each cell of a grid, cheap and smooth.
#pragma once
#include <cstddef>
#include <memory>

namespace dtr {

/// What it costs to change from one label to another between neighbouring cells.
struct LabelChanges {
  size_t steps = 0;  ///< the first so many labels are steps of one scale,
  float next = 0;    ///< this far from one to the next,
  float any = 0;     ///< and this between any two labels
};

/// Semi-global matching along rows and columns, both ways (Hirschmueller 2008, eq. 13).
class SemiGlobal {
 public:
  SemiGlobal(int columns, int rows, size_t labels, const LabelChanges& changes, int threads);

  /// A cell's cost of a label: all are to be set before Solve.
  void SetCost(int x, int y, size_t label, float cost) { costs_[At(x, y) + SlotOf(label)] = cost; }
  /// Does not depend on the number of threads.
  void Solve();
  /// After Solve: costs summed over all paths to the cell.
  float SumOf(int x, int y, size_t label) const { return sums_[At(x, y) + SlotOf(label)]; }
  /// The label of the least sum, the first of several.
  size_t Best(int x, int y) const;

 private:
  // Steps and other labels each fill whole vectors; what they leave costs infinity, so that no path
  // goes there.
  size_t SlotOf(size_t label) const {
    return label < changes_.steps ? label : step_slots_ + label - changes_.steps;
  }
  size_t At(int x, int y) const {
    return (static_cast<size_t>(y) * static_cast<size_t>(columns_) + static_cast<size_t>(x)) *
           slots_;
  }

  const int columns_, rows_;
  const LabelChanges changes_;
  const size_t step_slots_, slots_;
  const int threads_;
  std::unique_ptr<float[]> costs_, sums_;  ///< per cell and slot
};

}  // namespace dtr
