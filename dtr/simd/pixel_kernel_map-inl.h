// dtr/simd/pixel_kernel_map-inl.h -- SPEC 5.3: where rays meet the surface that a view's map holds.
// Compiled per instruction set: include only from pixel_kernel.cpp.
#if defined(DTR_SIMD_PIXEL_KERNEL_MAP_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DTR_SIMD_PIXEL_KERNEL_MAP_INL_H_
#undef DTR_SIMD_PIXEL_KERNEL_MAP_INL_H_
#else
#define DTR_SIMD_PIXEL_KERNEL_MAP_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace dtr::simd::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::ScalableTag<float>;
using DI = hn::ScalableTag<std::int32_t>;
using DU = hn::ScalableTag<std::uint32_t>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;
using VU = hn::Vec<DU>;
using MF = hn::Mask<DF>;
constexpr size_t kLanes = hn::MaxLanes(DF());

// SPEC 6.1: inverse depths whose depth float32 holds as a normal number.
constexpr float kMin = 1e-37f, kMax = 1e37f, kFar = -3.4e38f;

HWY_INLINE VF Constant(float value) { return hn::Set(DF(), value); }
HWY_INLINE VF Lerp(VF a, VF b, VF share) { return hn::MulAdd(share, hn::Sub(b, a), a); }

/// Rays of a group of pixels in a row, z = 1.
struct Rays {
  VF x;
  float y;
  VF squared;  ///< their squared lengths
};

/// The group's rays on a view's grid: a ray at inverse depth w is at base + away w, homogeneous.
struct RayOnGrid {
  VF x, y, z;
  HWY_INLINE RayOnGrid(const PixelView& view, const Rays& rays)
      : x(hn::MulAdd(rays.x, Constant(view.grid_x[0]),
                     Constant(view.grid_x[1] * rays.y + view.grid_x[2]))),
        y(hn::MulAdd(rays.x, Constant(view.grid_y[0]),
                     Constant(view.grid_y[1] * rays.y + view.grid_y[2]))),
        z(hn::MulAdd(rays.x, Constant(view.grid_z[0]),
                     Constant(view.grid_z[1] * rays.y + view.grid_z[2]))) {}
};

struct Position {
  VF x, y;
  MF on_map;  ///< before the view and on its map; else the position is 0
};

HWY_INLINE Position PositionAt(const PixelView& view, const RayOnGrid& base, VF w) {
  const VF z = hn::MulAdd(w, Constant(view.grid_z[3]), base.z);
  const VF per_z = hn::Div(Constant(1), z);
  const VF x = hn::Mul(hn::MulAdd(w, Constant(view.grid_x[3]), base.x), per_z);
  const VF y = hn::Mul(hn::MulAdd(w, Constant(view.grid_y[3]), base.y), per_z);
  const VF half_x = Constant(0.5f * static_cast<float>(view.columns));
  const VF half_y = Constant(0.5f * static_cast<float>(view.rows));
  const MF on_map = hn::And(hn::And(hn::Gt(z, hn::Zero(DF())), hn::Gt(w, hn::Zero(DF()))),
                            hn::And(hn::Le(hn::Abs(hn::Sub(x, half_x)), half_x),
                                    hn::Le(hn::Abs(hn::Sub(y, half_y)), half_y)));
  return {hn::IfThenElseZero(on_map, x), hn::IfThenElseZero(on_map, y), on_map};
}

/// Index of the sample in column x of row y, both from -1 on.
HWY_INLINE VI IndexOf(const PixelView& view, VI x, VI y) {
  return hn::Add(hn::Mul(hn::Add(y, hn::Set(DI(), 1)), hn::Set(DI(), view.stride)),
                 hn::Add(x, hn::Set(DI(), 1)));
}

#if HWY_TARGET != HWY_SCALAR
/// Pixels beside each other mostly look at places beside each other: a window of two rows and
/// 2 kLanes columns holds them all. It is read row by row and its values are put in their lanes
/// instead of being fetched one by one.
struct Window {
  bool holds;       ///< else nothing here means anything
  bool two_rows;    ///< some lanes are in the second row
  int column, row;  ///< of its upper left corner
  VI right;         ///< of that column, per lane
  MF lower;         ///< lanes in the second row

  HWY_INLINE Window(VI x, VI y, MF asked) {
    const DI di;
    const auto valid = hn::RebindMask(di, asked);
    const VI beyond = hn::Set(di, std::numeric_limits<std::int32_t>::max());
    column = hn::GetLane(hn::MinOfLanes(di, hn::IfThenElse(valid, x, beyond)));
    row = hn::GetLane(hn::MinOfLanes(di, hn::IfThenElse(valid, y, beyond)));
    right = hn::IfThenElseZero(valid, hn::Sub(x, hn::Set(di, column)));
    const VI below = hn::IfThenElseZero(valid, hn::Sub(y, hn::Set(di, row)));
    holds = hn::AllTrue(
        di, hn::And(hn::Lt(right, hn::Set(di, 2 * kLanes - 1)), hn::Lt(below, hn::Set(di, 2))));
    const auto second = hn::Gt(below, hn::Zero(di));
    two_rows = !hn::AllFalse(di, second);
    lower = hn::RebindMask(DF(), second);
  }
};

HWY_INLINE VI Lookup(VI table, VI index) {
  const DI di;
  const VI within = hn::And(index, hn::Set(di, static_cast<int>(kLanes) - 1));
  return hn::TableLookupLanes(table, hn::IndicesFromVec(di, within));
}

/// Of 2 kLanes words from `first` on, for each lane the one at its index.
HWY_INLINE VU WordsFrom(const std::uint32_t* first, VI index) {
  const VI near = hn::BitCast(DI(), hn::LoadU(DU(), first));
  const VI far = hn::BitCast(DI(), hn::LoadU(DU(), first + kLanes));
  const auto is_near = hn::Lt(index, hn::Set(DI(), static_cast<int>(kLanes)));
  return hn::BitCast(DU(), hn::IfThenElse(is_near, Lookup(near, index), Lookup(far, index)));
}

/// Of 2 kLanes codes from `first` on, for each lane the one at its index (at most 2 kLanes - 2) and
/// the next, as PairsOfCodes has them.
HWY_INLINE VI PairsFrom(const std::uint16_t* first, VI index) {
  const DI di;
  const VI one = hn::Set(di, 1), half = hn::ShiftRight<1>(index);
  const VI codes = hn::BitCast(di, hn::LoadU(hn::Repartition<std::uint16_t, DI>(), first));
  const VI even = Lookup(codes, half), next = Lookup(codes, hn::Add(half, one));
  const VI odd = hn::BitCast(di, hn::Or(hn::ShiftRight<16>(hn::BitCast(DU(), even)),
                                        hn::ShiftLeft<16>(hn::BitCast(DU(), next))));
  return hn::IfThenElse(hn::Eq(hn::And(index, one), one), odd, even);
}
#endif

struct FourWords {
  VU a, b, c, d;  ///< a b above c d
};

#if HWY_TARGET != HWY_SCALAR
/// Around each lane's place in the window; `corner` is the window's upper left one.
HWY_INLINE FourWords WordsIn(const Window& window, const std::uint32_t* corner,
                             std::ptrdiff_t stride) {
  const VI right = hn::Add(window.right, hn::Set(DI(), 1));
  FourWords words{WordsFrom(corner, window.right), WordsFrom(corner, right),
                  WordsFrom(corner + stride, window.right), WordsFrom(corner + stride, right)};
  if (window.two_rows) {
    const auto second = hn::RebindMask(DU(), window.lower);
    words.a = hn::IfThenElse(second, words.c, words.a);
    words.b = hn::IfThenElse(second, words.d, words.b);
    corner += 2 * stride;
    words.c = hn::IfThenElse(second, WordsFrom(corner, window.right), words.c);
    words.d = hn::IfThenElse(second, WordsFrom(corner, right), words.d);
  }
  return words;
}
#endif

/// Around the words of these indices, left above, in rows of `stride`.
HWY_INLINE FourWords GatherWords(const std::uint32_t* words, VI index, int stride) {
  const VI one = hn::Set(DI(), 1), below = hn::Add(index, hn::Set(DI(), stride));
  return {hn::GatherIndex(DU(), words, index), hn::GatherIndex(DU(), words, hn::Add(index, one)),
          hn::GatherIndex(DU(), words, below), hn::GatherIndex(DU(), words, hn::Add(below, one))};
}

/// Two codes that lie beside each other, the left one in the lower half.
HWY_INLINE VI PairsOfCodes(const PixelView& view, VI index) {
  return hn::GatherOffset(DI(), reinterpret_cast<const std::int32_t*>(view.codes),
                          hn::Add(index, index));
}
HWY_INLINE VF LowerCode(VI pairs) {
  return hn::ConvertTo(DF(), hn::And(pairs, hn::Set(DI(), 0xffff)));
}
HWY_INLINE VF UpperCode(VI pairs) {
  return hn::ConvertTo(DF(), hn::BitCast(DI(), hn::ShiftRight<16>(hn::BitCast(DU(), pairs))));
}

struct FourSamples {
  VF a, b, c, d;  ///< a b above c d
};
HWY_INLINE FourSamples SamplesOfPairs(VI upper, VI lower) {
  return {LowerCode(upper), UpperCode(upper), LowerCode(lower), UpperCode(lower)};
}
HWY_INLINE FourSamples SamplesOfWords(const FourWords& words) {
  const DF d;
  return {hn::BitCast(d, words.a), hn::BitCast(d, words.b), hn::BitCast(d, words.c),
          hn::BitCast(d, words.d)};
}
/// Around the positions that are asked for; `index` is that of the left upper ones.
HWY_INLINE FourSamples SamplesAt(const PixelView& view, [[maybe_unused]] VI x,
                                 [[maybe_unused]] VI y, VI index, [[maybe_unused]] MF asked) {
  const auto* values = reinterpret_cast<const std::uint32_t*>(view.values);
#if HWY_TARGET != HWY_SCALAR
  const Window window(x, y, asked);
  if (window.holds) {
    const std::ptrdiff_t corner =
        static_cast<std::ptrdiff_t>(window.row + 1) * view.stride + window.column + 1;
    if (view.codes == nullptr) return SamplesOfWords(WordsIn(window, values + corner, view.stride));
    const std::uint16_t* first = view.codes + corner;
    VI upper = PairsFrom(first, window.right);
    VI lower = PairsFrom(first + view.stride, window.right);
    if (window.two_rows) {
      const auto second = hn::RebindMask(DI(), window.lower);
      upper = hn::IfThenElse(second, lower, upper);
      lower = hn::IfThenElse(second, PairsFrom(first + 2 * view.stride, window.right), lower);
    }
    return SamplesOfPairs(upper, lower);
  }
#endif
  if (view.codes == nullptr) return SamplesOfWords(GatherWords(values, index, view.stride));
  return SamplesOfPairs(PairsOfCodes(view, index),
                        PairsOfCodes(view, hn::Add(index, hn::Set(DI(), view.stride))));
}

/// SPEC 5.3: the blocks whose four samples belong together.
HWY_INLINE MF IsWhole(const PixelView& view, VI index) {
  const VU bit = hn::BitCast(DU(), index);
  const VU words = hn::GatherIndex(DU(), view.whole_blocks, hn::ShiftRight<5>(index));
  const VU found = hn::And(hn::Shr(words, hn::And(bit, hn::Set(DU(), 31))), hn::Set(DU(), 1));
  return hn::RebindMask(DF(), hn::Ne(found, hn::Zero(DU())));
}

/// A PixelCell for each position; requires cells.
HWY_INLINE VU CellsAt(const PixelView& view, const Position& position) {
  // The block left of and above a position, counted from the border's.
  const VF half = Constant(0.5f);
  const VI x = hn::ShiftRight<kLog2PixelCell>(hn::ConvertTo(DI(), hn::Add(position.x, half)));
  const VI y = hn::ShiftRight<kLog2PixelCell>(hn::ConvertTo(DI(), hn::Add(position.y, half)));
  return hn::GatherIndex(DU(), view.cells, hn::Add(hn::Mul(y, hn::Set(DI(), view.cell_stride)), x));
}
HWY_INLINE MF IsCell(VU cells, PixelCell kind) {
  return hn::RebindMask(DF(), hn::Eq(cells, hn::Set(DU(), kind)));
}

/// The view's surface around a position of its grid.
struct Patch {
  VF inverse_depth, slope_x, slope_y;  ///< 1/z at the position; its change per sample
  MF exists, whole;                    ///< of four samples that belong together
  MF masked;                           ///< the view does not look there
};

/// SPEC 5.3: the tangent of the bilinear patch, else the nearest sample, flat.
HWY_INLINE Patch PatchAt(const PixelView& view, const Position& position) {
  const VF zero = hn::Zero(DF()), half = Constant(0.5f);
  const VF low_x = hn::Floor(hn::Sub(position.x, half));
  const VF low_y = hn::Floor(hn::Sub(position.y, half));
  const VF u = hn::Sub(hn::Sub(position.x, half), low_x);
  const VF v = hn::Sub(hn::Sub(position.y, half), low_y);
  const VI column = hn::ConvertTo(DI(), low_x), row = hn::ConvertTo(DI(), low_y);
  const VI index = IndexOf(view, column, row);
  const FourSamples s = SamplesAt(view, column, row, index, position.on_map);
  const VF lowest = hn::Min(hn::Min(s.a, s.b), hn::Min(s.c, s.d));
  const VF highest = hn::Max(hn::Max(s.a, s.b), hn::Max(s.c, s.d));
  const VF factor = Constant(view.depth_factor);
  const MF full = hn::Gt(lowest, zero);
  MF whole =
      hn::And(full, hn::Le(hn::Mul(factor, hn::Sub(highest, lowest)), Constant(view.level_range)));
  if (!hn::AllFalse(DF(), hn::AndNot(whole, full))) whole = hn::And(full, IsWhole(view, index));
  MF masked = hn::Eq(highest, zero);
  if (!hn::AllFalse(DF(), masked)) masked = hn::And(masked, IsWhole(view, index));
  const VF top = Lerp(s.a, s.b, u), bottom = Lerp(s.c, s.d, u);
  const MF left = hn::Lt(u, half), upper = hn::Lt(v, half);
  const VF nearest =
      hn::IfThenElse(upper, hn::IfThenElse(left, s.a, s.b), hn::IfThenElse(left, s.c, s.d));
  const VF stored = hn::IfThenElse(whole, Lerp(top, bottom, v), nearest);
  const VF slope_x = Lerp(hn::Sub(s.b, s.a), hn::Sub(s.d, s.c), v);
  return {hn::MulAdd(stored, factor, Constant(view.depth_offset)),
          hn::IfThenElseZero(whole, hn::Mul(factor, slope_x)),
          hn::IfThenElseZero(whole, hn::Mul(factor, hn::Sub(bottom, top))),
          hn::And(position.on_map, hn::Gt(stored, zero)),
          whole,
          masked};
}

/// 1/z at which the ray meets the patch's plane; 0 where it shows its back or there is none.
HWY_INLINE VF Meet(const PixelView& view, const RayOnGrid& base, const Position& position,
                   const Patch& patch) {
  // The view's own 1/z at grid point q is w / q.z, so that plane . q = w on the tangent plane.
  const VF rest = hn::NegMulAdd(patch.slope_y, position.y,
                                hn::NegMulAdd(patch.slope_x, position.x, patch.inverse_depth));
  const VF facing =
      hn::NegMulAdd(patch.slope_x, Constant(view.grid_x[3]),
                    hn::NegMulAdd(patch.slope_y, Constant(view.grid_y[3]),
                                  hn::NegMulAdd(rest, Constant(view.grid_z[3]), Constant(1))));
  const VF w = hn::Div(
      hn::MulAdd(patch.slope_x, base.x, hn::MulAdd(patch.slope_y, base.y, hn::Mul(rest, base.z))),
      facing);
  const MF meets = hn::And(hn::Gt(facing, hn::Zero(DF())),
                           hn::And(hn::Ge(w, Constant(kMin)), hn::Le(w, Constant(kMax))));
  return hn::IfThenElseZero(hn::And(patch.exists, meets), w);
}

}  // namespace dtr::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
