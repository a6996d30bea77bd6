#include "calib/sfm/matching/nearest.h"

#include <algorithm>
#include <cassert>
#include <cmath>

// The rest of this file is compiled once per instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "calib/sfm/matching/nearest.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef DTR_SFM_MATCHING_NEAREST_SHARED
#define DTR_SFM_MATCHING_NEAREST_SHARED
namespace dtr::sfm::matching {
inline constexpr size_t kSize = std::tuple_size_v<Descriptor>;
inline constexpr size_t kBlock = 16;  // columns of a packed block
inline constexpr size_t kRows = 4;    // rows whose sums are held in registers
inline constexpr size_t kChunk = 32;  // rows that stay in the first cache: 16 KB

/// Best and second best dot product and the index of the best, of many at a time.
struct Tops {
  explicit Tops(size_t count) : best(count, -1.0f), second(count, -1.0f), index(count, -1.0f) {}
  std::vector<float> best, second, index;
};

/// What the kernel works on: rows (a, row by row) against blocks of columns (b, element by element
/// within a block); both padded with zeros.
struct Packed {
  const float* rows;
  const float* blocks;
  size_t row_count, padded_rows, column_count, block_count;
};
}  // namespace dtr::sfm::matching
#endif

HWY_BEFORE_NAMESPACE();
namespace dtr::sfm::matching::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, 8>;
using VF = hn::Vec<DF>;

/// Puts dots with the candidate of that index into the running best; lanes that are not `valid`
/// are left out.
HWY_INLINE void Put(VF dots, VF candidate, VF& best, VF& second, VF& index) {
  const auto better = hn::Gt(dots, best);
  second = hn::Max(second, hn::Min(dots, best));
  best = hn::Max(best, dots);
  index = hn::IfThenElse(better, candidate, index);
}

/// kRows rows from `row` against one pair of vectors of columns.
HWY_INLINE void PutTile(const Packed& p, size_t row, size_t chunk_row, size_t block, size_t lane,
                        float* row_tops, Tops& columns) {
  const DF d;
  const size_t n = hn::Lanes(d);
  const float* a = p.rows + row * kSize;
  const float* b = p.blocks + block * kBlock * kSize + lane;
  VF s00 = hn::Zero(d), s01 = s00, s10 = s00, s11 = s00, s20 = s00, s21 = s00, s30 = s00, s31 = s00;
  for (size_t k = 0; k < kSize; ++k) {
    const VF b0 = hn::LoadU(d, b + k * kBlock), b1 = hn::LoadU(d, b + k * kBlock + n);
    const VF a0 = hn::Set(d, a[k]), a1 = hn::Set(d, a[kSize + k]);
    s00 = hn::MulAdd(a0, b0, s00);
    s01 = hn::MulAdd(a0, b1, s01);
    s10 = hn::MulAdd(a1, b0, s10);
    s11 = hn::MulAdd(a1, b1, s11);
    const VF a2 = hn::Set(d, a[2 * kSize + k]), a3 = hn::Set(d, a[3 * kSize + k]);
    s20 = hn::MulAdd(a2, b0, s20);
    s21 = hn::MulAdd(a2, b1, s21);
    s30 = hn::MulAdd(a3, b0, s30);
    s31 = hn::MulAdd(a3, b1, s31);
  }
  const VF sums[2][kRows] = {{s00, s10, s20, s30}, {s01, s11, s21, s31}};
  for (size_t half = 0; half < 2; ++half) {
    const size_t column = block * kBlock + lane + half * n;
    if (column >= p.column_count) break;
    const VF columns_here = hn::Add(hn::Iota(d, 0.0f), hn::Set(d, static_cast<float>(column)));
    const auto valid = hn::Lt(columns_here, hn::Set(d, static_cast<float>(p.column_count)));
    VF best = hn::LoadU(d, &columns.best[column]), second = hn::LoadU(d, &columns.second[column]);
    VF index = hn::LoadU(d, &columns.index[column]);
    for (size_t r = 0; r < kRows && row + r < p.row_count; ++r) {
      const VF dots = hn::IfThenElse(valid, sums[half][r], hn::Set(d, -1.0f));
      Put(dots, hn::Set(d, static_cast<float>(row + r)), best, second, index);
      float* tops = row_tops + (chunk_row + r) * 3 * n;
      VF row_best = hn::LoadU(d, tops), row_second = hn::LoadU(d, tops + n);
      VF row_index = hn::LoadU(d, tops + 2 * n);
      Put(dots, columns_here, row_best, row_second, row_index);
      hn::StoreU(row_best, d, tops);
      hn::StoreU(row_second, d, tops + n);
      hn::StoreU(row_index, d, tops + 2 * n);
    }
    hn::StoreU(best, d, &columns.best[column]);
    hn::StoreU(second, d, &columns.second[column]);
    hn::StoreU(index, d, &columns.index[column]);
  }
}

/// The best of the lanes of a row: the lower index where dot products are the same.
HWY_INLINE void ReduceRow(const float* tops, size_t n, size_t row, Tops& rows) {
  float best = -1, second = -1, index = -1;
  for (size_t i = 0; i < n; ++i) {
    const float dot = tops[i], at = tops[2 * n + i];
    second = std::max({second, std::min(best, dot), tops[n + i]});
    if (dot > best || (dot == best && at < index)) {
      best = dot;
      index = at;
    }
  }
  rows.best[row] = best;
  rows.second[row] = second;
  rows.index[row] = index;
}

void FindNearestImpl(const Packed& p, Tops& rows, Tops& columns) {
  const DF d;
  const size_t n = hn::Lanes(d);
  std::vector<float> tops(kChunk * 3 * n);
  for (size_t first = 0; first < p.row_count; first += kChunk) {
    std::fill(tops.begin(), tops.end(), -1.0f);
    const size_t some = std::min(kChunk, p.row_count - first);
    for (size_t block = 0; block < p.block_count; ++block) {
      for (size_t lane = 0; lane < kBlock; lane += 2 * n) {
        for (size_t r = 0; r < some; r += kRows) {
          PutTile(p, first + r, r, block, lane, tops.data(), columns);
        }
      }
    }
    for (size_t r = 0; r < some; ++r) ReduceRow(&tops[r * 3 * n], n, first + r, rows);
  }
}

void DotProductsImpl(const std::uint8_t* query, const std::uint8_t* rows, const int* chosen,
                     size_t count, int* dots) {
  const hn::CappedTag<std::int16_t, 16> d16;
  const hn::Rebind<std::uint8_t, decltype(d16)> d8;
  const hn::RepartitionToWide<decltype(d16)> d32;
  const size_t n = hn::Lanes(d16);
  HWY_ALIGN std::int16_t wide[kSize];
  for (size_t k = 0; k < kSize; ++k) wide[k] = query[k];
  for (size_t i = 0; i < count; ++i) {
    const std::uint8_t* at = rows + static_cast<size_t>(chosen[i]) * kSize;
    auto sum0 = hn::Zero(d32), sum1 = hn::Zero(d32);
    for (size_t k = 0; k < kSize; k += n) {
      const auto row = hn::PromoteTo(d16, hn::LoadU(d8, at + k));
      sum0 = hn::ReorderWidenMulAccumulate(d32, row, hn::Load(d16, wide + k), sum0, sum1);
    }
    dots[i] = hn::GetLane(hn::SumOfLanes(d32, hn::Add(sum0, sum1)));
  }
}

}  // namespace dtr::sfm::matching::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace dtr::sfm::matching {

HWY_EXPORT(FindNearestImpl);
HWY_EXPORT(DotProductsImpl);

namespace {

std::vector<Nearest> FromTops(const Tops& tops, size_t count) {
  std::vector<Nearest> nearest(count);
  for (size_t i = 0; i < count; ++i) {
    nearest[i] = {static_cast<int>(tops.index[i]), static_cast<int>(tops.best[i]),
                  static_cast<int>(tops.second[i])};
  }
  return nearest;
}

}  // namespace

NearestBothWays FindNearest(std::span<const Descriptor> a, std::span<const Descriptor> b) {
  NearestBothWays result{std::vector<Nearest>(a.size()), std::vector<Nearest>(b.size())};
  if (a.empty() || b.empty()) return result;
  const size_t padded = (a.size() + kRows - 1) / kRows * kRows;
  const size_t blocks = (b.size() + kBlock - 1) / kBlock;
  std::vector<float> rows(padded * kSize), columns(blocks * kBlock * kSize);
  for (size_t i = 0; i < a.size(); ++i) std::copy(a[i].begin(), a[i].end(), &rows[i * kSize]);
  for (size_t j = 0; j < b.size(); ++j) {
    float* block = &columns[j / kBlock * kBlock * kSize + j % kBlock];
    for (size_t k = 0; k < kSize; ++k) block[k * kBlock] = b[j][k];
  }
  const Packed packed{rows.data(), columns.data(), a.size(), padded, b.size(), blocks};
  Tops of_rows(padded), of_columns(blocks * kBlock);
  HWY_DYNAMIC_DISPATCH(FindNearestImpl)(packed, of_rows, of_columns);
  return {FromTops(of_rows, a.size()), FromTops(of_columns, b.size())};
}

void DotProducts(const Descriptor& query, std::span<const Descriptor> rows,
                 std::span<const int> chosen, std::span<int> dots) {
  assert(chosen.size() == dots.size());
  if (chosen.empty()) return;
  HWY_DYNAMIC_DISPATCH(DotProductsImpl)
  (query.data(), rows.front().data(), chosen.data(), chosen.size(), dots.data());
}

float DescriptorAngle(int dot) {
  constexpr float kLengthSquared = 512.0f * 512.0f;
  return std::acos(std::clamp(static_cast<float>(dot) / kLengthSquared, 0.0f, 1.0f));
}

bool IsDistinct(const Nearest& nearest, float ratio) {
  if (nearest.index < 0) return false;
  return DescriptorAngle(nearest.dot) < ratio * DescriptorAngle(nearest.second);
}

}  // namespace dtr::sfm::matching
#endif
