#include "dtr/gl/pixel_kernel.h"

#include <algorithm>
#include <cmath>

// The rest of this file is compiled once per instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "dtr/gl/pixel_kernel.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace dtr::gl::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::ScalableTag<float>;
using DI = hn::ScalableTag<std::int32_t>;
using DU = hn::ScalableTag<std::uint32_t>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;
using VU = hn::Vec<DU>;
using MF = hn::Mask<DF>;
constexpr size_t kLanes = hn::MaxLanes(DF());

// As in own_depth.glsl and resolve.frag.
constexpr float kHeldBeforePx = 1.0f, kBeforePx = 0.5f, kBehindPx = 2.0f;
constexpr float kHoleSay = 0.25f;
constexpr int kTriedSurfaces = 3;
constexpr float kBorderShare = 1e-4f;
constexpr float kLeastOthers = 1e-6f;
// SPEC 6.1: inverse depths whose depth float32 holds as a normal number.
constexpr float kLeast = 1e-37f, kMost = 1e37f, kFar = -3.4e38f;

HWY_INLINE VF Constant(float value) { return hn::Set(DF(), value); }
HWY_INLINE VF Lerp(VF a, VF b, VF share) { return hn::MulAdd(share, hn::Sub(b, a), a); }

/// The pixels of a group and what the views say of them.
struct Group {
  HWY_ALIGN float inverse_depth[kMostPixelViews][kLanes];  ///< fragments; 0: none
  HWY_ALIGN float image_x[kMostPixelViews][kLanes];        ///< on the view's image
  HWY_ALIGN float image_y[kMostPixelViews][kLanes];
  HWY_ALIGN float weight[kMostPixelViews][kLanes];
};

/// The group's rays on a view's grid: a ray at inverse depth w is at base + away w, homogeneous.
struct RayOnGrid {
  VF x, y, z;
  HWY_INLINE RayOnGrid(const PixelView& view, VF ray_x, float ray_y)
      : x(hn::MulAdd(ray_x, Constant(view.grid_x[0]),
                     Constant(view.grid_x[1] * ray_y + view.grid_x[2]))),
        y(hn::MulAdd(ray_x, Constant(view.grid_y[0]),
                     Constant(view.grid_y[1] * ray_y + view.grid_y[2]))),
        z(hn::MulAdd(ray_x, Constant(view.grid_z[0]),
                     Constant(view.grid_z[1] * ray_y + view.grid_z[2]))) {}
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
HWY_INLINE FourSamples SamplesAt(const PixelView& view, VI index) {
  const VI below = hn::Add(index, hn::Set(DI(), view.stride));
  if (view.codes != nullptr) {
    const VI upper = PairsOfCodes(view, index), lower = PairsOfCodes(view, below);
    return {LowerCode(upper), UpperCode(upper), LowerCode(lower), UpperCode(lower)};
  }
  const VI one = hn::Set(DI(), 1);
  return {hn::GatherIndex(DF(), view.values, index),
          hn::GatherIndex(DF(), view.values, hn::Add(index, one)),
          hn::GatherIndex(DF(), view.values, below),
          hn::GatherIndex(DF(), view.values, hn::Add(below, one))};
}

/// SPEC 5.3: the blocks whose four samples belong together.
HWY_INLINE MF IsWhole(const PixelView& view, VI index) {
  const VU bit = hn::BitCast(DU(), index);
  const VU words = hn::GatherIndex(DU(), view.whole_blocks, hn::ShiftRight<5>(index));
  const VU found = hn::And(hn::Shr(words, hn::And(bit, hn::Set(DU(), 31))), hn::Set(DU(), 1));
  return hn::RebindMask(DF(), hn::Ne(found, hn::Zero(DU())));
}

/// The view's surface around a position of its grid.
struct Patch {
  VF inverse_depth, slope_x, slope_y;  ///< 1/z at the position; its change per sample
  MF exists, whole;                    ///< of four samples that belong together
};

/// SPEC 5.3: the tangent of the bilinear patch, else the nearest sample, flat.
HWY_INLINE Patch PatchAt(const PixelView& view, const Position& position) {
  const VF zero = hn::Zero(DF()), half = Constant(0.5f);
  const VF low_x = hn::Floor(hn::Sub(position.x, half));
  const VF low_y = hn::Floor(hn::Sub(position.y, half));
  const VF u = hn::Sub(hn::Sub(position.x, half), low_x);
  const VF v = hn::Sub(hn::Sub(position.y, half), low_y);
  const VI index = IndexOf(view, hn::ConvertTo(DI(), low_x), hn::ConvertTo(DI(), low_y));
  const FourSamples s = SamplesAt(view, index);
  const VF lowest = hn::Min(hn::Min(s.a, s.b), hn::Min(s.c, s.d));
  const VF highest = hn::Max(hn::Max(s.a, s.b), hn::Max(s.c, s.d));
  const VF factor = Constant(view.depth_factor);
  const MF full = hn::Gt(lowest, zero);
  MF whole =
      hn::And(full, hn::Le(hn::Mul(factor, hn::Sub(highest, lowest)), Constant(view.level_range)));
  if (!hn::AllFalse(DF(), hn::AndNot(whole, full))) whole = hn::And(full, IsWhole(view, index));
  const VF top = Lerp(s.a, s.b, u), bottom = Lerp(s.c, s.d, u);
  const MF left = hn::Lt(u, half), upper = hn::Lt(v, half);
  const VF nearest =
      hn::IfThenElse(upper, hn::IfThenElse(left, s.a, s.b), hn::IfThenElse(left, s.c, s.d));
  const VF stored = hn::IfThenElse(whole, Lerp(top, bottom, v), nearest);
  const VF slope_x = Lerp(hn::Sub(s.b, s.a), hn::Sub(s.d, s.c), v);
  return {hn::MulAdd(stored, factor, Constant(view.depth_offset)),
          hn::IfThenElseZero(whole, hn::Mul(factor, slope_x)),
          hn::IfThenElseZero(whole, hn::Mul(factor, hn::Sub(bottom, top))),
          hn::And(position.on_map, hn::Gt(stored, zero)), whole};
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
                           hn::And(hn::Ge(w, Constant(kLeast)), hn::Le(w, Constant(kMost))));
  return hn::IfThenElseZero(hn::And(patch.exists, meets), w);
}

/// SPEC 5.2: what the views say of a surface.
struct Votes {
  VF held, refused;
  VF front;   ///< 1/z of the nearest whole patch of those that hold it; 0: none
  VF behind;  ///< 1/z of the nearest surface that a view sees through it; 0: none
};

HWY_INLINE void AddVote(const PixelView& view, VF surface, VF seen, MF whole, VF say,
                        Votes* votes) {
  const DF d;
  const VF nearer = hn::Sub(seen, surface), zero = hn::Zero(d);
  const MF shows = hn::Gt(seen, zero);
  const MF through = hn::And(shows, hn::Lt(nearer, Constant(-kBehindPx * view.pixel)));
  const MF holds =
      hn::And(hn::AndNot(through, shows), hn::Le(nearer, Constant(kHeldBeforePx * view.pixel)));
  const VF hole_say = hn::Mul(Constant(kHoleSay), say);
  votes->refused =
      hn::Add(votes->refused, hn::IfThenElse(shows, hn::IfThenElseZero(through, say), hole_say));
  votes->held = hn::Add(votes->held, hn::IfThenElseZero(holds, say));
  votes->behind = hn::Max(votes->behind, hn::IfThenElseZero(through, seen));
  const MF near = hn::Le(nearer, Constant(kBeforePx * view.pixel));
  votes->front =
      hn::Max(votes->front, hn::IfThenElseZero(hn::And(hn::And(holds, whole), near), seen));
}

/// The angle t of SPEC 4.5 at the point at inverse depth w: its sine squared and its cosine, both
/// times a common factor. From the view's centre, so that nothing cancels where t is small.
struct Angle {
  VF across_squared, along;
  HWY_INLINE Angle(const PixelView& view, VF ray_x, float ray_y, VF ray_squared, VF w) {
    const VF c = hn::MulAdd(ray_x, Constant(view.centre[0]),
                            Constant(view.centre[1] * ray_y + view.centre[2]));
    const VF across = hn::Max(
        hn::NegMulAdd(c, c, hn::Mul(Constant(view.centre_squared), ray_squared)), hn::Zero(DF()));
    across_squared = hn::Mul(hn::Mul(w, w), across);
    along = hn::NegMulAdd(w, c, ray_squared);
  }
};

/// 1 / (tan^2 t + t_pixel^2); 0 from 90 degrees on.
HWY_INLINE VF SayAt(const Angle& angle, float pixel_angle_rad) {
  const VF along_squared = hn::Mul(angle.along, angle.along);
  const VF say = hn::Div(
      along_squared,
      hn::MulAdd(along_squared, Constant(pixel_angle_rad * pixel_angle_rad), angle.across_squared));
  return hn::IfThenElseZero(hn::Gt(angle.along, hn::Zero(DF())), say);
}

/// t in radians; off by less than 3e-5 of itself (minimax polynomial), far below what shows in 8
/// bits.
HWY_INLINE VF RadiansOf(const Angle& angle) {
  const DF d;
  const VF across = hn::Sqrt(angle.across_squared), along = hn::Abs(angle.along);
  const VF longer = hn::Max(hn::Max(across, along), Constant(1e-30f));
  const VF a = hn::Div(hn::Min(across, along), longer), s = hn::Mul(a, a);
  VF p = Constant(-0.01172120f);
  for (const float coefficient :
       {0.05265332f, -0.11643287f, 0.19354346f, -0.33262347f, 0.99997726f}) {
    p = hn::MulAdd(p, s, Constant(coefficient));
  }
  VF t = hn::Mul(a, p);
  t = hn::IfThenElse(hn::Gt(across, along), hn::Sub(Constant(1.57079632679f), t), t);
  return hn::IfThenElse(hn::Lt(angle.along, hn::Zero(d)), hn::Sub(Constant(3.14159265359f), t), t);
}

HWY_INLINE VF WeightAt(const Angle& angle, const PixelRow& row) {
  const VF base = hn::Div(Constant(1), hn::Add(RadiansOf(angle), Constant(row.pixel_angle_rad)));
  VF weight = base;
  for (int k = 1; k < row.power; ++k) weight = hn::Mul(weight, base);
  return weight;
}

/// SPEC 5.3: the view's fragment near `surface`; 0: the view shows another surface there, or none.
/// Leaves where the fragment lies on the image.
HWY_INLINE VF FragmentAt(const PixelView& view, const RayOnGrid& base, VF surface, float* image_x,
                         float* image_y) {
  const DF d;
  const Position position = PositionAt(view, base, surface);
  if (hn::AllFalse(d, position.on_map)) return hn::Zero(d);
  const VF w = Meet(view, base, position, PatchAt(view, position));
  const VF nearer = hn::Sub(w, surface);
  const VF z = hn::MulAdd(w, Constant(view.grid_z[3]), base.z);
  MF found = hn::And(hn::Gt(w, hn::Zero(d)), hn::Gt(z, hn::Zero(d)));
  found = hn::And(found, hn::And(hn::Le(nearer, Constant(kBeforePx * view.pixel)),
                                 hn::Ge(nearer, Constant(-kBehindPx * view.pixel))));
  const VF per_z = hn::Div(Constant(1), z);
  const VF x = hn::Mul(hn::MulAdd(w, Constant(view.grid_x[3]), base.x), per_z);
  const VF y = hn::Mul(hn::MulAdd(w, Constant(view.grid_y[3]), base.y), per_z);
  hn::Store(hn::IfThenElseZero(found, hn::MulAdd(x, Constant(view.image_per_sample[0]),
                                                 Constant(view.image_offset[0]))),
            d, image_x);
  hn::Store(hn::IfThenElseZero(found, hn::MulAdd(y, Constant(view.image_per_sample[1]),
                                                 Constant(view.image_offset[1]))),
            d, image_y);
  return hn::IfThenElseZero(found, w);
}

struct Colour {
  VF r, g, b, a;  ///< of 255
};

template <int kShift>
HWY_INLINE VF Channel(VU texel) {
  return hn::ConvertTo(
      DF(), hn::BitCast(DI(), hn::And(hn::ShiftRight<kShift>(texel), hn::Set(DU(), 255))));
}

/// SPEC 4.4 and, as alpha, the rim's factor of 4.8.
HWY_INLINE Colour ColourAt(const PixelView& view, VF x, VF y) {
  const DI di;
  const DU du;
  const VF zero = hn::Zero(DF());
  x = hn::Min(hn::Max(x, zero), Constant(static_cast<float>(view.width_px - 1)));
  y = hn::Min(hn::Max(y, zero), Constant(static_cast<float>(view.height_px - 1)));
  const VI left = hn::ConvertTo(di, x), above = hn::ConvertTo(di, y);  // not negative
  const VF u = hn::Sub(x, hn::ConvertTo(DF(), left)), v = hn::Sub(y, hn::ConvertTo(DF(), above));
  const VI width = hn::Set(di, view.width_px), one = hn::Set(di, 1);
  const VI right = hn::Min(hn::Add(left, one), hn::Sub(width, one));
  const VI below = hn::Min(hn::Add(above, one), hn::Set(di, view.height_px - 1));
  const VI upper_row = hn::Mul(above, width), lower_row = hn::Mul(below, width);
  const VU a = hn::GatherIndex(du, view.rgba, hn::Add(upper_row, left));
  const VU b = hn::GatherIndex(du, view.rgba, hn::Add(upper_row, right));
  const VU c = hn::GatherIndex(du, view.rgba, hn::Add(lower_row, left));
  const VU e = hn::GatherIndex(du, view.rgba, hn::Add(lower_row, right));
  const auto mixed = [&](VF p, VF q, VF r, VF s) { return Lerp(Lerp(p, q, u), Lerp(r, s, u), v); };
  return {mixed(Channel<0>(a), Channel<0>(b), Channel<0>(c), Channel<0>(e)),
          mixed(Channel<8>(a), Channel<8>(b), Channel<8>(c), Channel<8>(e)),
          mixed(Channel<16>(a), Channel<16>(b), Channel<16>(c), Channel<16>(e)),
          mixed(Channel<24>(a), Channel<24>(b), Channel<24>(c), Channel<24>(e))};
}

/// SPEC 4.8: what is left of a view's share of the weights. Of shares, since the product of two
/// weights need not fit float32.
HWY_INLINE VF FadedShare(VF share, VF factor) {
  const VF others =
      hn::Add(Constant(kLeastOthers), hn::Max(hn::Sub(Constant(1), share), hn::Zero(DF())));
  const VF rest = hn::MulAdd(hn::Sub(Constant(1), factor), share, others);
  return hn::Div(hn::Mul(hn::Mul(share, factor), others), rest);
}

/// Asks for what the later steps read of a view around where the first step looked: the processor
/// then fetches it while other views are worked on.
HWY_INLINE void PrefetchAround(const PixelView& view, const Position& position) {
  const float x = hn::GetLane(position.x), y = hn::GetLane(position.y);
  const auto column = static_cast<std::ptrdiff_t>(x), row = static_cast<std::ptrdiff_t>(y);
  if (view.codes != nullptr) {
    // The next group's samples; from the right row of the two that the second step will need.
    const std::uint16_t* code = view.codes + (row + 1) * view.stride + column + 1 + 2 * kLanes;
    hwy::Prefetch(code);
    hwy::Prefetch(code + view.stride);
  }
  const float image_x = x * view.image_per_sample[0] + view.image_offset[0];
  const float image_y = y * view.image_per_sample[1] + view.image_offset[1];
  const auto pixel_x = static_cast<std::ptrdiff_t>(std::max(image_x, 0.0f));
  const auto pixel_y = static_cast<std::ptrdiff_t>(std::max(image_y, 0.0f));
  const std::uint32_t* pixel = view.rgba + pixel_y * view.width_px + pixel_x;
  for (const int below : {0, 1}) {
    hwy::Prefetch(pixel + below * view.width_px);
    hwy::Prefetch(pixel + below * view.width_px + kLanes);
  }
}

/// SPEC 5.2: the surface that is held; 0 where none is.
HWY_INLINE VF HeldSurface(const PixelRow& row, std::span<const PixelView> views, VF ray_x,
                          float ray_y, VF ray_squared, VF surface) {
  const DF d;
  const VF zero = hn::Zero(d);
  VF held = zero;
  MF asked = hn::Gt(surface, zero);
  for (int tried = 0; tried < kTriedSurfaces && !hn::AllFalse(d, asked); ++tried) {
    Votes votes{zero, zero, zero, zero};
    for (const PixelView& view : views) {
      const RayOnGrid base(view, ray_x, ray_y);
      const Position position = PositionAt(view, base, surface);
      if (hn::AllFalse(d, position.on_map)) continue;
      if (tried == 0) PrefetchAround(view, position);
      const Patch patch = PatchAt(view, position);
      const VF seen = Meet(view, base, position, patch);
      const VF say = SayAt({view, ray_x, ray_y, ray_squared, surface}, row.pixel_angle_rad);
      AddVote(view, surface, seen, patch.whole, hn::IfThenElseZero(position.on_map, say), &votes);
    }
    const MF holds = hn::And(asked, hn::Ge(votes.held, votes.refused));
    const VF front = hn::IfThenElse(hn::Gt(votes.front, zero), votes.front, surface);
    held = hn::IfThenElse(holds, front, held);
    surface = votes.behind;
    asked = hn::And(hn::AndNot(holds, asked), hn::Gt(surface, zero));
  }
  return held;
}

struct Pixels {
  VU image, marks;
  VF depth;
};

HWY_INLINE Pixels ResolveGroup(const PixelRow& row, std::span<const PixelView> views, VF x,
                               VF surface, Group* group) {
  const DF d;
  const VF zero = hn::Zero(d);
  const VF ray_x = hn::Mul(hn::Sub(x, Constant(row.cx)), Constant(row.inverse_fx));
  const float ray_y = (row.y - row.cy) * row.inverse_fy;
  const VF ray_squared = hn::MulAdd(ray_x, ray_x, Constant(ray_y * ray_y + 1));
  const Pixels none{hn::Zero(DU()), hn::Zero(DU()), zero};
  surface = HeldSurface(row, views, ray_x, ray_y, ray_squared, surface);
  const MF held = hn::Gt(surface, zero);
  if (hn::AllFalse(d, held)) return none;

  // SPEC 5.3 and 4.2.
  VF front = zero, border = Constant(kFar);
  for (size_t i = 0; i < views.size(); ++i) {
    const VF w = FragmentAt(views[i], {views[i], ray_x, ray_y}, surface, group->image_x[i],
                            group->image_y[i]);
    hn::Store(w, d, group->inverse_depth[i]);
    front = hn::Max(front, w);
    border = hn::Max(border, hn::IfThenElse(hn::Gt(w, zero), hn::Sub(w, Constant(views[i].delta)),
                                            Constant(kFar)));
  }
  const MF seen = hn::Gt(front, zero);
  if (hn::AllFalse(d, seen)) return none;

  // SPEC 4.3, 4.5, 4.6.
  const VF margin = hn::Mul(Constant(kBorderShare), hn::Sub(front, border));
  VF total = zero, blended = zero;
  MF at_border = hn::Lt(zero, zero);
  for (size_t i = 0; i < views.size(); ++i) {
    const VF w = hn::Load(d, group->inverse_depth[i]);
    const MF exists = hn::Gt(w, zero);
    at_border = hn::Or(at_border, hn::And(exists, hn::Le(hn::Abs(hn::Sub(w, border)), margin)));
    const MF shown = hn::And(exists, hn::Ge(w, border));
    VF weight = zero;
    if (!hn::AllFalse(d, shown)) {
      weight = hn::IfThenElseZero(shown, WeightAt({views[i], ray_x, ray_y, ray_squared, w}, row));
      blended = hn::Add(blended, hn::IfThenElseZero(shown, Constant(1)));
      total = hn::Add(total, weight);
    }
    hn::Store(weight, d, group->weight[i]);
  }

  // SPEC 4.4, 4.7, 4.8.
  VF r = zero, g = zero, b = zero, sum = zero;
  const VF per_total = hn::Div(Constant(1), total);
  for (size_t i = 0; i < views.size(); ++i) {
    const VF weight = hn::Load(d, group->weight[i]);
    if (hn::AllFalse(d, hn::Gt(weight, zero))) continue;
    const Colour colour =
        ColourAt(views[i], hn::Load(d, group->image_x[i]), hn::Load(d, group->image_y[i]));
    const VF factor = hn::Mul(hn::Max(colour.a, Constant(1)), Constant(views[i].cut_factor / 255));
    const VF faded = FadedShare(hn::Mul(weight, per_total), factor);
    r = hn::MulAdd(faded, colour.r, r);
    g = hn::MulAdd(faded, colour.g, g);
    b = hn::MulAdd(faded, colour.b, b);
    sum = hn::Add(sum, faded);
  }
  const VF per_sum = hn::Div(Constant(1), sum), half = Constant(0.5f);
  const auto level = [&](VF c) {
    return hn::BitCast(DU(),
                       hn::ConvertTo(DI(), hn::MulAdd(hn::IfThenElseZero(seen, c), per_sum, half)));
  };
  const auto seen_bits = hn::RebindMask(DU(), seen);
  VU image = hn::Or(level(r), hn::Set(DU(), 0xff000000u));
  image = hn::Or(image, hn::Or(hn::ShiftLeft<8>(level(g)), hn::ShiftLeft<16>(level(b))));
  VU marks = hn::BitCast(DU(), hn::ConvertTo(DI(), blended));
  marks =
      hn::Or(marks, hn::IfThenElseZero(hn::RebindMask(DU(), at_border), hn::Set(DU(), 0xff00u)));
  return {hn::IfThenElseZero(seen_bits, image), hn::IfThenElseZero(seen_bits, marks),
          hn::IfThenElseZero(seen, hn::Div(Constant(1), front))};
}

void ResolveRowImpl(const PixelRow& row, std::span<const PixelView> views) {
  const DF d;
  Group group;
  for (int x = 0; x < row.width_px; x += static_cast<int>(kLanes)) {
    const auto count = std::min(kLanes, static_cast<size_t>(row.width_px - x));
    HWY_ALIGN float surfaces[kLanes] = {};
    std::copy_n(row.surface + x, count, surfaces);
    const VF surface = hn::Load(d, surfaces);
    Pixels pixels{hn::Zero(DU()), hn::Zero(DU()), hn::Zero(d)};
    if (!hn::AllFalse(d, hn::Gt(surface, hn::Zero(d)))) {
      pixels = ResolveGroup(row, views, hn::Iota(d, static_cast<float>(x) + 0.5f), surface, &group);
    }
    HWY_ALIGN std::uint32_t lanes[2][kLanes];
    HWY_ALIGN float depths[kLanes];
    hn::Store(pixels.image, DU(), lanes[0]);
    hn::Store(pixels.marks, DU(), lanes[1]);
    hn::Store(pixels.depth, d, depths);
    std::copy_n(lanes[0], count, row.image + x);
    std::copy_n(lanes[1], count, row.marks + x);
    std::copy_n(depths, count, row.depth + x);
  }
}

}  // namespace dtr::gl::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace dtr::gl {

HWY_EXPORT(ResolveRowImpl);

void ResolvePixelRow(const PixelRow& row, std::span<const PixelView> views) {
  HWY_DYNAMIC_DISPATCH(ResolveRowImpl)(row, views);
}

}  // namespace dtr::gl
#endif
