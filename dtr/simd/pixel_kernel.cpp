#include "dtr/simd/pixel_kernel.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dtr/render/colour.h"
#include "dtr/render/deferred_limits.h"
#include "dtr/render/exposure.h"

// The rest of this file is compiled once per instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "dtr/simd/pixel_kernel.cpp"
#include <hwy/aligned_allocator.h>
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// After highway.h.
#include <hwy/contrib/math/math-inl.h>

#include "dtr/simd/pixel_kernel_map-inl.h"
#include "dtr/simd/pixel_kernel_weights-inl.h"

HWY_BEFORE_NAMESPACE();
namespace dtr::simd::HWY_NAMESPACE {

/// SPEC 5.2: how the views vote on a surface.
struct Votes {
  VF support, against;
  VF front;            ///< 1/z of the nearest whole patch of those that support it; 0: none
  VF behind;           ///< 1/z of the nearest surface that a view sees through it; 0: none
  VF total, heaviest;  ///< of the weights of all who see anything there, or a hole
  VF of_heaviest;      ///< 1/z of that view's own surface; 0: none
};

/// What any vote counts for, whatever it says.
HWY_INLINE void AddWeight(VF seen, VF vote, Votes* votes) {
  votes->total = hn::Add(votes->total, vote);
  votes->of_heaviest = hn::IfThenElse(hn::Gt(vote, votes->heaviest), seen, votes->of_heaviest);
  votes->heaviest = hn::Max(vote, votes->heaviest);
}

/// SPEC 5.2: one view decides alone.
HWY_INLINE MF OneDecides(const Votes& votes) {
  return hn::And(hn::Gt(votes.of_heaviest, hn::Zero(DF())),
                 hn::Gt(votes.heaviest, hn::Mul(Constant(kDecidingShare), votes.total)));
}

HWY_INLINE void AddVote(const PixelView& view, VF surface, VF seen, MF whole, VF vote,
                        Votes* votes) {
  const DF d;
  AddWeight(seen, vote, votes);
  const VF nearer = hn::Sub(seen, surface), zero = hn::Zero(d);
  const MF shows = hn::Gt(seen, zero);
  const MF through = hn::And(shows, hn::Lt(nearer, Constant(-kBehindPx * view.pixel)));
  const MF supports =
      hn::And(hn::AndNot(through, shows), hn::Le(nearer, Constant(kSupportBeforePx * view.pixel)));
  const VF hole_vote = hn::Mul(Constant(kHoleVote), vote);
  votes->against =
      hn::Add(votes->against, hn::IfThenElse(shows, hn::IfThenElseZero(through, vote), hole_vote));
  votes->support = hn::Add(votes->support, hn::IfThenElseZero(supports, vote));
  votes->behind = hn::Max(votes->behind, hn::IfThenElseZero(through, seen));
  const MF near = hn::Le(nearer, Constant(kFragmentBeforePx * view.pixel));
  votes->front =
      hn::Max(votes->front, hn::IfThenElseZero(hn::And(hn::And(supports, whole), near), seen));
}

struct Colour {
  VF r, g, b, a;  ///< of 255
};

template <int kShift>
HWY_INLINE VF Channel(VU texel) {
  return hn::ConvertTo(
      DF(), hn::BitCast(DI(), hn::And(hn::ShiftRight<kShift>(texel), hn::Set(DU(), 255))));
}

/// Around the pixels that are asked for. One beyond the image's border weighs nothing.
HWY_INLINE FourWords PixelsAt(const PixelView& view, VI left, VI above, [[maybe_unused]] MF asked) {
#if HWY_TARGET != HWY_SCALAR
  const Window window(left, above, asked);
  if (window.holds) {
    const std::ptrdiff_t corner =
        static_cast<std::ptrdiff_t>(window.row) * view.width_px + window.column;
    return WordsIn(window, view.rgba + corner, view.width_px);
  }
#endif
  const VI index = hn::Add(hn::Mul(above, hn::Set(DI(), view.width_px)), left);
  return GatherWords(view.rgba, index, view.width_px);
}

/// A channel's value: 8-bit sRGB, or what a table has for it.
template <int kShift>
HWY_INLINE VF Light(const float* linear, VU texel) {
  if (linear == nullptr) return Channel<kShift>(texel);
  const VU level = hn::And(hn::ShiftRight<kShift>(texel), hn::Set(DU(), 255));
  return hn::GatherIndex(DF(), linear, hn::BitCast(DI(), level));
}

/// SPEC 4.4 and, as alpha, the rim's factor of 4.8; of no meaning where it is not asked for.
/// `linear`: as PixelRow.
HWY_INLINE Colour ColourAt(const PixelView& view, const float* linear, VF x, VF y, MF asked) {
  const DI di;
  const VF zero = hn::Zero(DF());
  x = hn::Min(hn::Max(x, zero), Constant(static_cast<float>(view.width_px - 1)));
  y = hn::Min(hn::Max(y, zero), Constant(static_cast<float>(view.height_px - 1)));
  const VI left = hn::ConvertTo(di, x), above = hn::ConvertTo(di, y);  // not negative
  const VF u = hn::Sub(x, hn::ConvertTo(DF(), left)), v = hn::Sub(y, hn::ConvertTo(DF(), above));
  const auto [a, b, c, e] = PixelsAt(view, left, above, asked);
  const auto mixed = [&](VF p, VF q, VF r, VF s) { return Lerp(Lerp(p, q, u), Lerp(r, s, u), v); };
  return {
      mixed(Light<0>(linear, a), Light<0>(linear, b), Light<0>(linear, c), Light<0>(linear, e)),
      mixed(Light<8>(linear, a), Light<8>(linear, b), Light<8>(linear, c), Light<8>(linear, e)),
      mixed(Light<16>(linear, a), Light<16>(linear, b), Light<16>(linear, c), Light<16>(linear, e)),
      mixed(Channel<24>(a), Channel<24>(b), Channel<24>(c), Channel<24>(e))};
}

/// SPEC 5.3: the view's fragment near `surface`; 0: the view shows another surface there, or none.
/// Leaves where the fragment lies on the image.
HWY_INLINE VF FragmentAt(const PixelView& view, const RayOnGrid& base, VF surface, float* image_x,
                         float* image_y) {
  const DF d;
  const Position position = PositionAt(view, base, surface);
  if (hn::AllFalse(d, position.on_map)) return hn::Zero(d);
  if (view.cells != nullptr &&
      hn::AllFalse(d, hn::And(position.on_map, IsCell(CellsAt(view, position), kCellOfSamples)))) {
    return hn::Zero(d);
  }
  const VF w = Meet(view, base, position, PatchAt(view, position));
  const VF nearer = hn::Sub(w, surface);
  const VF z = hn::MulAdd(w, Constant(view.grid_z[3]), base.z);
  MF found = hn::And(hn::Gt(w, hn::Zero(d)), hn::Gt(z, hn::Zero(d)));
  found = hn::And(found, hn::And(hn::Le(nearer, Constant(kFragmentBeforePx * view.pixel)),
                                 hn::Ge(nearer, Constant(-kBehindPx * view.pixel))));
  const VF per_z = hn::Div(Constant(1), z);
  VF x = hn::Mul(hn::MulAdd(w, Constant(view.grid_x[3]), base.x), per_z);
  VF y = hn::Mul(hn::MulAdd(w, Constant(view.grid_y[3]), base.y), per_z);
  x = hn::IfThenElseZero(
      found, hn::MulAdd(x, Constant(view.image_per_sample[0]), Constant(view.image_offset[0])));
  y = hn::IfThenElseZero(
      found, hn::MulAdd(y, Constant(view.image_per_sample[1]), Constant(view.image_offset[1])));
  hn::Store(x, d, image_x);
  hn::Store(y, d, image_y);
  // SPEC 4.4: no fragment where all pixels around are masked.
  if (view.masked && !hn::AllFalse(d, found))
    found = hn::And(found, hn::Gt(ColourAt(view, nullptr, x, y, found).a, hn::Zero(d)));
  return hn::IfThenElseZero(found, w);
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
  } else {
    const float* value = view.values + (row + 1) * view.stride + column + 1 + 2 * kLanes;
    hwy::Prefetch(value);
    hwy::Prefetch(value + view.stride);
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

/// SPEC 5.2: the supported surface; 0 where none is.
HWY_INLINE VF SupportedSurface(const PixelRow& row, std::span<const PixelView> views,
                               const Rays& rays, VF surface) {
  const DF d;
  const VF zero = hn::Zero(d);
  VF supported = zero;
  MF asked = hn::Gt(surface, zero);
  for (int tried = 0; tried < kMaxSurfaces && !hn::AllFalse(d, asked); ++tried) {
    Votes votes{zero, zero, zero, zero, zero, zero, zero};
    for (const PixelView& view : views) {
      const RayOnGrid base(view, rays);
      const Position position = PositionAt(view, base, surface);
      if (hn::AllFalse(d, position.on_map)) continue;
      VF vote = hn::IfThenElseZero(position.on_map,
                                   VoteWeightAt({row, view, rays, surface}, row.pixel_angle_rad));
      if (view.cells != nullptr) {
        const VU cells = CellsAt(view, position);
        if (hn::AllFalse(d, hn::And(position.on_map, IsCell(cells, kCellOfSamples)))) {
          vote = hn::IfThenElseZero(IsCell(cells, kCellOfHoles), vote);
          votes.against = hn::MulAdd(Constant(kHoleVote), vote, votes.against);
          AddWeight(zero, vote, &votes);
          continue;
        }
      }
      if (tried == 0) PrefetchAround(view, position);
      const Patch patch = PatchAt(view, position);
      const VF seen = Meet(view, base, position, patch);
      AddVote(view, surface, seen, patch.whole, hn::IfThenZeroElse(patch.masked, vote), &votes);
    }
    const MF decided = OneDecides(votes);
    const MF supports = hn::And(asked, hn::Or(decided, hn::Ge(votes.support, votes.against)));
    const VF front = hn::IfThenElse(hn::Gt(votes.front, zero), votes.front, surface);
    supported =
        hn::IfThenElse(supports, hn::IfThenElse(decided, votes.of_heaviest, front), supported);
    surface = votes.behind;
    asked = hn::And(hn::AndNot(supports, asked), hn::Gt(surface, zero));
  }
  return supported;
}

struct Pixels {
  VU image, marks;
  VF depth;
};

/// SPEC 4.2: where Delta moves a fragment.
HWY_INLINE VF Moved(const PixelRow& row, const PixelView& view, VF w) {
  if (row.absolute_delta < 0) return hn::Sub(w, Constant(view.delta));
  const VF one = Constant(1);
  return hn::Min(w, hn::Div(one, hn::Add(hn::Div(one, w), Constant(row.absolute_delta))));
}

/// The nearest fragment, and the border of SPEC 4.2.
struct Front {
  VF nearest, border;
};

/// SPEC 4.4 (ClippedShare).
HWY_INLINE VF ClippedShareOf(const PixelRow& row, const PixelView& view, const Colour& colour) {
  const float unit = row.linear == nullptr ? 1 / 255.0f : 1;
  const VF greatest = hn::Mul(hn::Max(hn::Max(colour.r, colour.g), colour.b), Constant(unit));
  const VF square = hn::Mul(greatest, greatest), fourth = hn::Mul(square, square);
  const VF white = row.linear == nullptr ? hn::Mul(fourth, fourth) : fourth;
  return hn::Mul(Constant(view.clipped), hn::Min(hn::Add(white, white), Constant(1)));
}

/// SPEC 4.4: the greatest value of each channel that a photo has at `w` and did not clip.
HWY_INLINE Colour Unclipped(const PixelRow& row, std::span<const PixelView> views, const Rays& rays,
                            VF w) {
  const DF d;
  const VF zero = hn::Zero(d);
  Colour greatest{zero, zero, zero, zero};
  for (const PixelView& view : views) {
    const RayOnGrid base(view, rays);
    const VF z = hn::MulAdd(w, Constant(view.grid_z[3]), base.z), per_z = hn::Div(Constant(1), z);
    const auto on_image = [&](VF along, int axis) {
      return hn::MulAdd(hn::Mul(along, per_z), Constant(view.image_per_sample[axis]),
                        Constant(view.image_offset[axis]));
    };
    const VF x = on_image(hn::MulAdd(w, Constant(view.grid_x[3]), base.x), 0);
    const VF y = on_image(hn::MulAdd(w, Constant(view.grid_y[3]), base.y), 1);
    const auto within = [](VF at, int size_px) {
      const float half = 0.5f * static_cast<float>(size_px);
      return hn::Lt(hn::Abs(hn::Sub(at, Constant(half - 0.5f))), Constant(half));
    };
    MF is = hn::And(hn::And(hn::Gt(w, zero), hn::Gt(z, zero)),
                    hn::And(within(x, view.width_px), within(y, view.height_px)));
    if (hn::AllFalse(d, is)) continue;
    const Colour colour =
        ColourAt(view, row.linear, hn::IfThenElseZero(is, x), hn::IfThenElseZero(is, y), is);
    is = hn::And(is, hn::And(hn::Gt(colour.a, zero),
                             hn::Lt(ClippedShareOf(row, view, colour), Constant(0.5f))));
    greatest.r = hn::Max(greatest.r, hn::IfThenElseZero(is, colour.r));
    greatest.g = hn::Max(greatest.g, hn::IfThenElseZero(is, colour.g));
    greatest.b = hn::Max(greatest.b, hn::IfThenElseZero(is, colour.b));
  }
  return greatest;
}

/// SPEC 4.4: a clipped colour as others measured it, where they measured one.
HWY_INLINE void Restore(const PixelRow& row, const PixelView& view, const Colour& unclipped,
                        Colour* colour) {
  const VF share_of_same = Constant(
      static_cast<float>(row.linear == nullptr ? kSameSurface : kSameSurfaceInLinearLight));
  const auto least = [&](VF of) { return hn::Mul(share_of_same, of); };
  const MF same = hn::And(
      hn::Ge(unclipped.r, least(colour->r)),
      hn::And(hn::Ge(unclipped.g, least(colour->g)), hn::Ge(unclipped.b, least(colour->b))));
  const VF share = hn::IfThenElseZero(same, ClippedShareOf(row, view, *colour));
  colour->r = hn::MulAdd(share, hn::Sub(unclipped.r, colour->r), colour->r);
  colour->g = hn::MulAdd(share, hn::Sub(unclipped.g, colour->g), colour->g);
  colour->b = hn::MulAdd(share, hn::Sub(unclipped.b, colour->b), colour->b);
}

/// SPEC 5.3 and 4.2: each view's fragment near `surface` into the group.
HWY_INLINE Front FindFragments(const PixelRow& row, std::span<const PixelView> views,
                               const Rays& rays, VF surface, Group* group) {
  const DF d;
  const VF zero = hn::Zero(d);
  VF front = zero, border = Constant(kFar);
  for (size_t i = 0; i < views.size(); ++i) {
    VF w = FragmentAt(views[i], {views[i], rays}, surface, group->image_x(i), group->image_y(i));
    if (row.nearest_views > 0 && !hn::AllFalse(d, hn::Gt(w, zero))) {  // SPEC 1.3
      const VF t = PreciseRadiansOf({row, views[i], rays, w});
      w = hn::IfThenElseZero(hn::Le(t, Constant(row.max_angle_rad)), w);
    }
    hn::Store(w, d, group->inverse_depth(i));
    front = hn::Max(front, w);
    border =
        hn::Max(border, hn::IfThenElse(hn::Gt(w, zero), Moved(row, views[i], w), Constant(kFar)));
  }
  return {front, border};
}

/// SPEC 6.2.
HWY_INLINE MF AtBorder(size_t views, const Front& front, Group* group) {
  const DF d;
  const VF zero = hn::Zero(d);
  const VF margin = hn::Mul(Constant(kBorderShare), hn::Sub(front.nearest, front.border));
  MF at_border = hn::Lt(zero, zero);
  for (size_t i = 0; i < views; ++i) {
    const VF w = hn::Load(d, group->inverse_depth(i));
    at_border = hn::Or(at_border,
                       hn::And(hn::Gt(w, zero), hn::Le(hn::Abs(hn::Sub(w, front.border)), margin)));
  }
  return at_border;
}

/// SPEC 4.4, 4.7, 4.8: the colours' sum, of 255 or in linear light, and, as alpha, that of the
/// shares. `cut`: of SPEC 1.4, with the per-pixel rule.
HWY_INLINE Colour Blend(const PixelRow& row, std::span<const PixelView> views, VF total, VF cut,
                        const Colour& unclipped, Group* group) {
  const DF d;
  const VF zero = hn::Zero(d);
  VF r = zero, g = zero, b = zero, sum = zero;
  const VF per_total = hn::Div(Constant(1), total);
  for (size_t i = 0; i < views.size(); ++i) {
    const VF weight = hn::Load(d, group->weight(i));
    const MF weighs = hn::Gt(weight, zero);
    if (hn::AllFalse(d, weighs)) continue;
    Colour colour = ColourAt(views[i], row.linear, hn::Load(d, group->image_x(i)),
                             hn::Load(d, group->image_y(i)), weighs);
    if (views[i].clipped > 0) Restore(row, views[i], unclipped, &colour);
    const VF rim = hn::Max(colour.a, Constant(1));
    const VF fading =
        hn::Min(hn::MulAdd(rim, Constant(views[i].fade_gain / 255), Constant(views[i].fade_offset)),
                Constant(1));
    VF factor = hn::Mul(fading, Constant(views[i].cut_factor));
    if (row.nearest_views > 0) {
      factor = hn::Mul(factor, CutFactorAt(hn::Load(d, group->angle(i)), cut));
    }
    const VF faded = FadedShare(hn::Mul(weight, per_total), factor);
    r = hn::MulAdd(faded, colour.r, r);
    g = hn::MulAdd(faded, colour.g, g);
    b = hn::MulAdd(faded, colour.b, b);
    sum = hn::Add(sum, faded);
  }
  return {r, g, b, sum};
}

/// The nearest 8-bit sRGB value of linear light.
HWY_INLINE VU LevelOfLight(VF light) {
  HWY_ALIGN float lights[kLanes];
  HWY_ALIGN std::uint32_t levels[kLanes];
  hn::Store(light, DF(), lights);
  for (size_t i = 0; i < kLanes; ++i) levels[i] = Srgb8FromLinear(lights[i]);
  return hn::Load(DU(), levels);
}

HWY_INLINE Pixels ResolveGroup(const PixelRow& row, std::span<const PixelView> views, VF x,
                               VF surface, Group* group) {
  const DF d;
  const VF zero = hn::Zero(d);
  const VF ray_x = hn::Mul(hn::Sub(x, Constant(row.cx)), Constant(row.inverse_fx));
  const float ray_y = (row.y - row.cy) * row.inverse_fy;
  const Rays rays{ray_x, ray_y, hn::MulAdd(ray_x, ray_x, Constant(ray_y * ray_y + 1))};
  const Pixels none{hn::Zero(DU()), hn::Zero(DU()), zero};
  surface = SupportedSurface(row, views, rays, surface);
  if (hn::AllFalse(d, hn::Gt(surface, zero))) return none;

  const Front front = FindFragments(row, views, rays, surface, group);
  const MF seen = hn::Gt(front.nearest, zero);
  if (hn::AllFalse(d, seen)) return none;
  const MF at_border = AtBorder(views.size(), front, group);
  Colour unclipped{zero, zero, zero, zero};
  if (row.clipped) unclipped = Unclipped(row, views, rays, front.nearest);
  VF cut = zero;
  if (row.nearest_views > 0) cut = DropAllButNearest(row, views, rays, front.border, group);
  const Weighed weighed = WeighFragments(row, views, rays, front.border, group);
  const Colour sum = Blend(row, views, weighed.total, cut, unclipped, group);

  const VF per_sum = hn::Div(Constant(1), sum.a), half = Constant(0.5f);
  const auto level = [&](VF of_sum) {
    const VF c = hn::IfThenElseZero(seen, of_sum);
    if (row.linear != nullptr) return LevelOfLight(hn::Mul(c, per_sum));
    return hn::BitCast(DU(), hn::ConvertTo(DI(), hn::MulAdd(c, per_sum, half)));
  };
  const auto seen_bits = hn::RebindMask(DU(), seen);
  VU image = hn::Or(level(sum.r), hn::Set(DU(), 0xff000000u));
  image = hn::Or(image, hn::Or(hn::ShiftLeft<8>(level(sum.g)), hn::ShiftLeft<16>(level(sum.b))));
  const VF blended = hn::Min(weighed.blended, Constant(255));
  VU marks = hn::BitCast(DU(), hn::ConvertTo(DI(), blended));
  marks =
      hn::Or(marks, hn::IfThenElseZero(hn::RebindMask(DU(), at_border), hn::Set(DU(), 0xff00u)));
  return {hn::IfThenElseZero(seen_bits, image), hn::IfThenElseZero(seen_bits, marks),
          hn::IfThenElseZero(seen, hn::Div(Constant(1), front.nearest))};
}

const char* NameImpl() { return hwy::TargetName(HWY_TARGET); }

void ResolveRowImpl(const PixelRow& row, std::span<const PixelView> views) {
  const DF d;
  Group group(std::max<size_t>(1, views.size()));
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

}  // namespace dtr::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace dtr::simd {

HWY_EXPORT(NameImpl);
HWY_EXPORT(ResolveRowImpl);

const char* InstructionSet() { return HWY_DYNAMIC_DISPATCH(NameImpl)(); }

void ResolvePixelRow(const PixelRow& row, std::span<const PixelView> views) {
  HWY_DYNAMIC_DISPATCH(ResolveRowImpl)(row, views);
}

}  // namespace dtr::simd
#endif
