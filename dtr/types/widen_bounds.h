// dtr/types/widen_bounds.h -- one box around two.
#pragma once
#include "dtr/types/dtr_set.h"

namespace dtr {

/// The smallest box around `bounds` and `other`; an empty one adds nothing.
inline void Widen(const Bounds& other, Bounds& bounds) {
  if (other.empty()) return;
  if (bounds.empty()) {
    bounds = other;
    return;
  }
  bounds.min = bounds.min.cwiseMin(other.min);
  bounds.max = bounds.max.cwiseMax(other.max);
}

}  // namespace dtr
