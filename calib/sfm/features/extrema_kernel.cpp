#include "calib/sfm/features/extrema_kernel.h"

#include <algorithm>
#include <bit>
#include <cstdint>

// The rest of this file is compiled once per instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "calib/sfm/features/extrema_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace dtr::sfm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, 16>;
using VF = hn::Vec<DF>;

constexpr int kLanes = static_cast<int>(hn::MaxLanes(DF()));

/// Values around one pixel with the sign of that pixel's.
class Neighbours {
 public:
  Neighbours(const ScaleRows& rows, int x, VF sign) : rows_(rows), x_(x), sign_(sign) {}
  HWY_INLINE VF At(size_t scale, size_t row, int dx) const {
    return hn::Xor(hn::LoadU(DF(), rows_[scale][row] + x_ + dx), sign_);
  }
  HWY_INLINE VF MaxOfThree(size_t scale, size_t row) const {
    return hn::Max(At(scale, row, -1), hn::Max(At(scale, row, 0), At(scale, row, 1)));
  }
  HWY_INLINE VF MaxOfScale(size_t scale) const {
    return hn::Max(MaxOfThree(scale, 0), hn::Max(MaxOfThree(scale, 1), MaxOfThree(scale, 2)));
  }

 private:
  const ScaleRows& rows_;
  const int x_;
  const VF sign_;
};

/// Tests what rejects most pixels first.
void FindExtremaImpl(const ScaleRows& rows, int width, float min_contrast,
                     std::vector<int>* columns) {
  const DF d;
  const VF least = hn::Set(d, min_contrast);
  for (int x = 1; x < width - 1; x += kLanes) {
    const VF value = hn::LoadU(d, rows[1][1] + x);
    const VF size = hn::Abs(value);
    auto found = hn::Ge(size, least);
    if (hn::AllFalse(d, found)) continue;
    const Neighbours around(rows, x, hn::Xor(value, size));
    found = hn::And(found, hn::Gt(size, hn::Max(around.At(1, 1, -1), around.At(1, 1, 1))));
    found = hn::And(found, hn::Gt(size, hn::Max(around.At(0, 1, 0), around.At(2, 1, 0))));
    if (hn::AllFalse(d, found)) continue;
    found = hn::And(found, hn::Gt(size, hn::Max(around.MaxOfThree(1, 0), around.MaxOfThree(1, 2))));
    if (hn::AllFalse(d, found)) continue;
    found = hn::And(found, hn::Gt(size, hn::Max(around.MaxOfScale(0), around.MaxOfScale(2))));
    if (hn::AllFalse(d, found)) continue;
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, found, bytes);
    const int end = std::min(kLanes, width - 1 - x);
    for (unsigned bits = bytes[0] | static_cast<unsigned>(bytes[1]) << 8; bits != 0;
         bits &= bits - 1) {
      const int lane = std::countr_zero(bits);
      if (lane < end) columns->push_back(x + lane);
    }
  }
}

}  // namespace dtr::sfm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace dtr::sfm {

HWY_EXPORT(FindExtremaImpl);

void FindExtrema(const ScaleRows& rows, int width, float min_contrast, std::vector<int>* columns) {
  HWY_DYNAMIC_DISPATCH(FindExtremaImpl)(rows, width, min_contrast, columns);
}

}  // namespace dtr::sfm
#endif
