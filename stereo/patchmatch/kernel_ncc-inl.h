// stereo/patchmatch/kernel_ncc-inl.h -- bilateral NCC of slanted windows. Compiled per instruction
// set: include only from kernel.cpp.
#if defined(DTR_STEREO_PATCHMATCH_KERNEL_NCC_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DTR_STEREO_PATCHMATCH_KERNEL_NCC_INL_H_
#undef DTR_STEREO_PATCHMATCH_KERNEL_NCC_INL_H_
#else
#define DTR_STEREO_PATCHMATCH_KERNEL_NCC_INL_H_
#endif

#include "stereo/patchmatch/kernel_sample-inl.h"

HWY_BEFORE_NAMESPACE();
namespace dtr::stereo::patchmatch::HWY_NAMESPACE {

constexpr size_t kLanes = hn::MaxLanes(DF());
static_assert(2 * kLanes <= kBorder, "a group's pixels must not leave the border");

/// Fall-off of the window's weights, exp(-distance s - difference c) with the distance in pixels
/// and the largest difference of a channel in levels. What is past an edge mostly differs in
/// colour, and is to have no say. On three views of plaza after one pass, share of all true pixels
/// within 1 % and mean displacement of edges: grey with c = 0.056 (Xu and Tao, CVPR 2019) 85.6
/// %, 2.28 px; grey with 0.11 86.1 %, 2.07 px; colour with 0.11 86.5 %, 1.93 px; with 0.2 the same,
/// on less texture.
constexpr float kSpatialFallOff = 0.0556f, kColourFallOff = 0.12f;
/// Variance of the noise of a photo, grey levels squared, added to a window's: where there is
/// nothing but noise NCC goes to 0 and not to chance values.
constexpr float kNoiseVariance = 0.5f;
/// A window may be stretched by this in the source; more needs a coarser level there.
constexpr float kLargestStretch = 4.0f;
static_assert(kLargestStretch * kRadius <= kTextureBorder - 2);
/// Windows squeezed to less than this share of their area are seen edge on.
constexpr float kSmallestArea = 0.05f;
/// Geometric consistency, as in ACMM: cost per pixel by which a round trip misses, and its cap.
constexpr float kCostPerRoundTripPx = 0.2f, kLargestRoundTripPx = 3.0f;
/// Views with less than this share of the best view's weight have no say. On plaza, share of all
/// true pixels within 1 %: 77.7 % with 0.1, 79.7 % with 0.3, 79.8 % with 0.5 and less precise.
constexpr float kMinWeight = 0.4f;

/// Pixels x, x + 2, x + 4, ... of a row with their windows of the reference.
struct Group {
  int x = 0, y = 0;
  HWY_ALIGN float weight[kTaps][kLanes];    ///< sum to 1
  HWY_ALIGN float weighted[kTaps][kLanes];  ///< weight * (grey - mean)
  HWY_ALIGN float variance[kLanes];
  HWY_ALIGN float texture[kLanes];  ///< variance of the pixels like the centre, grey levels squared
  HWY_ALIGN float squared_weights[kLanes];    ///< their sum: one over the samples that count
  HWY_ALIGN float ray[kMaxViews][3][kLanes];  ///< m (x, y, 1) per source
  /// Samples of windows that fitted, kTaps each, since the group was made: what benchmarks count.
  mutable std::int64_t samples = 0;
};

HWY_INLINE VI EverySecond() { return hn::Add(hn::Iota(DI(), 0), hn::Iota(DI(), 0)); }

/// Every second value of a row from x on.
HWY_INLINE VF LoadColour(const BorderedGrid& grid, int x, int y) {
  return hn::GatherIndex(DF(), grid.at(x, y), EverySecond());
}

/// Largest difference of a channel.
HWY_INLINE VI ColourDifference(VI a, VI b) {
  const DI d;
  const VI byte = hn::Set(d, 255);
  const VI r = hn::Abs(hn::Sub(hn::And(a, byte), hn::And(b, byte)));
  const VI g =
      hn::Abs(hn::Sub(hn::And(hn::ShiftRight<8>(a), byte), hn::And(hn::ShiftRight<8>(b), byte)));
  const VI blue = hn::Abs(hn::Sub(hn::ShiftRight<16>(a), hn::ShiftRight<16>(b)));
  return hn::Max(r, hn::Max(g, blue));
}

/// Sets the group's place and its pixels' rays in the sources.
void PlaceGroup(const Level& level, int x, int y, Group* g) {
  const DF d;
  g->x = x;
  g->y = y;
  const VF px = hn::Add(hn::Set(d, static_cast<float>(x) + 0.5f), hn::ConvertTo(d, EverySecond()));
  const VF py = hn::Set(d, static_cast<float>(y) + 0.5f);
  for (size_t v = 0; v < level.sources.size(); ++v) {
    const float* m = level.sources[v].m;
    for (int i = 0; i < 3; ++i) {
      const VF rest = hn::MulAdd(hn::Set(d, m[3 * i + 1]), py, hn::Set(d, m[3 * i + 2]));
      hn::Store(hn::MulAdd(hn::Set(d, m[3 * i]), px, rest), d, g->ray[v][i]);
    }
  }
}

/// The same, and weights and values of the windows.
void PrepareGroup(const Level& level, int x, int y, Group* g) {
  const DF d;
  PlaceGroup(level, x, y, g);
  const VI lanes = EverySecond();
  const VI centre = hn::GatherIndex(DI(), level.reference.rgb.at(x, y), lanes);
  VF sum = hn::Zero(d), mean = hn::Zero(d), squares = hn::Zero(d);
  VF inner = hn::Zero(d), squared_weights = hn::Set(d, 1e-6f);
  int t = 0;
  for (int dy = -kRadius; dy <= kRadius; dy += kTapStep) {
    for (int dx = -kRadius; dx <= kRadius; dx += kTapStep, ++t) {
      const VF grey = hn::GatherIndex(d, level.reference.grey.at(x + dx, y + dy), lanes);
      const VF usable = hn::GatherIndex(d, level.reference.usable.at(x + dx, y + dy), lanes);
      const float distance = std::sqrt(static_cast<float>(dx * dx + dy * dy));
      const VI colour = hn::GatherIndex(DI(), level.reference.rgb.at(x + dx, y + dy), lanes);
      const VF diff = hn::ConvertTo(d, ColourDifference(colour, centre));
      const VF exponent =
          hn::MulAdd(diff, hn::Set(d, -kColourFallOff), hn::Set(d, -kSpatialFallOff * distance));
      const VF weight = hn::Mul(usable, hn::Exp(d, exponent));
      hn::Store(weight, d, g->weight[t]);
      hn::Store(grey, d, g->weighted[t]);
      sum = hn::Add(sum, weight);
      mean = hn::MulAdd(weight, grey, mean);
    }
  }
  const VF scale = hn::Div(hn::Set(d, 1.0f), hn::Max(sum, hn::Set(d, 1e-6f)));
  mean = hn::Mul(mean, scale);
  for (t = 0; t < kTaps; ++t) {
    const VF weight = hn::Mul(hn::Load(d, g->weight[t]), scale);
    const VF grey = hn::Sub(hn::Load(d, g->weighted[t]), mean);
    const VF weighted = hn::Mul(weight, grey);
    squares = hn::MulAdd(weighted, grey, squares);
    inner = hn::MulAdd(weighted, weighted, inner);
    squared_weights = hn::MulAdd(weight, weight, squared_weights);
    hn::Store(weight, d, g->weight[t]);
    hn::Store(weighted, d, g->weighted[t]);
  }
  hn::Store(squares, d, g->variance);
  hn::Store(squared_weights, d, g->squared_weights);
  hn::Store(hn::Div(inner, squared_weights), d, g->texture);
}

/// The window's position in a source and its change per pixel of the reference.
struct Warp {
  HWY_INLINE Warp() {}  // an implicit one would not be of this instruction set (GCC, NEON)
  VF u, v, ux, uy, vx, vy;
  hn::Mask<DF> fits;
};

HWY_INLINE Warp Locate(const Group& g, const Source& s, size_t view, VF w, VF a, VF b) {
  const DF d;
  const VF k0 = hn::Set(d, s.k[0]), k1 = hn::Set(d, s.k[1]), k2 = hn::Set(d, s.k[2]);
  const VF depth = hn::MulAdd(w, k2, hn::Load(d, g.ray[view][2]));
  const VF inverse = hn::Div(hn::Set(d, 1.0f), depth);
  Warp p;
  p.u = hn::Mul(hn::MulAdd(w, k0, hn::Load(d, g.ray[view][0])), inverse);
  p.v = hn::Mul(hn::MulAdd(w, k1, hn::Load(d, g.ray[view][1])), inverse);
  const VF zx = hn::MulAdd(a, k2, hn::Set(d, s.m[6])), zy = hn::MulAdd(b, k2, hn::Set(d, s.m[7]));
  p.ux = hn::Mul(inverse, hn::NegMulAdd(p.u, zx, hn::MulAdd(a, k0, hn::Set(d, s.m[0]))));
  p.uy = hn::Mul(inverse, hn::NegMulAdd(p.u, zy, hn::MulAdd(b, k0, hn::Set(d, s.m[1]))));
  p.vx = hn::Mul(inverse, hn::NegMulAdd(p.v, zx, hn::MulAdd(a, k1, hn::Set(d, s.m[3]))));
  p.vy = hn::Mul(inverse, hn::NegMulAdd(p.v, zy, hn::MulAdd(b, k1, hn::Set(d, s.m[4]))));
  const VF low = hn::Set(d, kTextureBorder - 0.5f);
  const VF right = hn::Set(d, static_cast<float>(kTextureBorder + s.texture->width) - 0.5f);
  const VF bottom = hn::Set(d, static_cast<float>(kTextureBorder + s.texture->height) - 0.5f);
  const VF stretch =
      hn::Max(hn::Add(hn::Abs(p.ux), hn::Abs(p.uy)), hn::Add(hn::Abs(p.vx), hn::Abs(p.vy)));
  const VF area = hn::NegMulAdd(p.uy, p.vx, hn::Mul(p.ux, p.vy));
  p.fits = hn::And(hn::Gt(depth, hn::Set(d, 1e-6f)),
                   hn::And(hn::And(hn::Gt(p.u, low), hn::Lt(p.u, right)),
                           hn::And(hn::Gt(p.v, low), hn::Lt(p.v, bottom))));
  p.fits = hn::And(p.fits, hn::And(hn::Lt(stretch, hn::Set(d, kLargestStretch)),
                                   hn::Gt(area, hn::Set(d, kSmallestArea))));
  return p;
}

/// Lanes whose window's centre the source's mask allows.
HWY_INLINE hn::Mask<DF> Allowed(const Texture& texture, const Warp& p) {
  const DF d;
  HWY_ALIGN float u[kLanes];
  HWY_ALIGN float v[kLanes];
  HWY_ALIGN float allowed[kLanes];
  const VF middle = hn::Set(d, kTextureBorder);
  hn::Store(hn::IfThenElse(p.fits, p.u, middle), d, u);
  hn::Store(hn::IfThenElse(p.fits, p.v, middle), d, v);
  for (size_t i = 0; i < kLanes; ++i) {
    const int x = static_cast<int>(u[i] + 0.5f) - kTextureBorder;
    const int y = static_cast<int>(v[i] + 0.5f) - kTextureBorder;
    allowed[i] = texture.usable.Contains(x, y) && texture.usable(x, y) != 0 ? 1.0f : 0.0f;
  }
  return hn::Gt(hn::Load(d, allowed), hn::Zero(d));
}

/// 1 - NCC of the reference's windows and the source's; kWorstCost where the window does not fit
/// into the source. Within a window the homography is taken as affine.
VF ScoreWindow(const Group& g, const Source& s, Warp p) {
  const DF d;
  const DI di;
  const VF worst = hn::Set(d, kWorstCost);
  if (hn::AllFalse(d, p.fits)) return worst;
  g.samples += kTaps * static_cast<std::int64_t>(hn::CountTrue(d, p.fits));
  // Lanes that do not fit read some place that exists.
  const VF corner = hn::Set(d, kTextureBorder);
  p.u = hn::IfThenElse(p.fits, p.u, corner);
  p.v = hn::IfThenElse(p.fits, p.v, corner);
  p.ux = hn::IfThenElseZero(p.fits, p.ux);
  p.uy = hn::IfThenElseZero(p.fits, p.uy);
  p.vx = hn::IfThenElseZero(p.fits, p.vx);
  p.vy = hn::IfThenElseZero(p.fits, p.vy);
  const VI column = hn::ConvertTo(di, p.u), row = hn::ConvertTo(di, p.v);  // positive: truncation
  const Sampler texture(reinterpret_cast<const std::int32_t*>(s.texture->quads.data()),
                        hn::Add(hn::Mul(row, hn::Set(di, s.texture->stride)), column),
                        s.texture->stride);
  const VF reach = hn::Set(d, static_cast<float>(kRadius));
  const VF skip = hn::Set(d, static_cast<float>(kTapStep));
  VI row_u =
      Fixed(hn::NegMulAdd(reach, hn::Add(p.ux, p.uy), hn::Sub(p.u, hn::ConvertTo(d, column))));
  VI row_v = Fixed(hn::NegMulAdd(reach, hn::Add(p.vx, p.vy), hn::Sub(p.v, hn::ConvertTo(d, row))));
  const VI du = Fixed(hn::Mul(skip, p.ux)), dv = Fixed(hn::Mul(skip, p.vx));
  const VI down_u = Fixed(hn::Mul(skip, p.uy)), down_v = Fixed(hn::Mul(skip, p.vy));
  VF mean = hn::Zero(d), squares = hn::Zero(d), product = hn::Zero(d);
  for (int j = 0; j < kTapsPerSide; ++j) {
    VI u = row_u, v = row_v;
    for (int i = 0; i < kTapsPerSide; ++i) {
      const VF value = hn::ConvertTo(d, texture.At(u, v));
      const VF part = hn::Mul(hn::Load(d, g.weight[kTapsPerSide * j + i]), value);
      mean = hn::Add(mean, part);
      squares = hn::MulAdd(part, value, squares);
      product = hn::MulAdd(hn::Load(d, g.weighted[kTapsPerSide * j + i]), value, product);
      u = hn::Add(u, du);
      v = hn::Add(v, dv);
    }
    row_u = hn::Add(row_u, down_u);
    row_v = hn::Add(row_v, down_v);
  }
  const VF grey = hn::Set(d, kGreyPerSample);
  mean = hn::Mul(mean, grey);
  squares = hn::Mul(hn::Mul(squares, grey), grey);
  product = hn::Mul(product, grey);
  const VF noise = hn::Set(d, kNoiseVariance);
  const VF variance = hn::Max(hn::Zero(d), hn::NegMulAdd(mean, mean, squares));
  const VF scale =
      hn::Sqrt(hn::Mul(hn::Add(variance, noise), hn::Add(hn::Load(d, g.variance), noise)));
  const VF cost = hn::Sub(hn::Set(d, 1.0f), hn::Div(product, scale));
  return hn::IfThenElse(p.fits, hn::Max(hn::Zero(d), cost), worst);
}

HWY_INLINE Warp LocateAllowed(const Group& g, const Source& s, size_t view, VF w, VF a, VF b) {
  Warp p = Locate(g, s, view, w, a, b);
  if (!s.texture->usable.empty()) p.fits = hn::And(p.fits, Allowed(*s.texture, p));
  return p;
}

/// Photometric cost of a plane in one view.
VF ScoreView(const Group& g, const Source& s, size_t view, VF w, VF a, VF b) {
  return ScoreWindow(g, s, LocateAllowed(g, s, view, w, a, b));
}

std::int64_t ScoreRowImpl(const Level& level, const State& state, int y,
                          std::span<const float> steps, float* costs) {
  const DF d;
  const int width = level.reference.width;
  HWY_ALIGN float lanes[kLanes];
  Group g;
  for (int start = 0; start < 2; ++start) {
    for (int x = start; x < width; x += 2 * static_cast<int>(kLanes)) {
      PrepareGroup(level, x, y, &g);
      const VF w = LoadColour(state.w, x, y);
      const VF a = LoadColour(state.a, x, y), b = LoadColour(state.b, x, y);
      for (size_t n = 0; n < steps.size(); ++n) {
        const VF moved = hn::Add(w, hn::Set(d, steps[n]));
        hn::Store(ScoreView(g, level.sources[0], 0, moved, a, b), d, lanes);
        float* row = costs + n * static_cast<size_t>(width);
        for (int i = 0; i < static_cast<int>(kLanes) && x + 2 * i < width; ++i) {
          row[x + 2 * i] = lanes[i];
        }
      }
    }
  }
  return g.samples;
}

/// Distance between a pixel and where it comes back to when its point is carried into the source
/// and the source's own surface there is carried back; at most kLargestRoundTripPx (Xu and Tao,
/// CVPR 2019, sec. 4.2).
VF RoundTripPx(const Group& g, const Source& s, const Warp& p) {
  const DF d;
  const DI di;
  const Grid<float>& map = s.surface->inverse_depth;
  const VF zero = hn::Zero(d), border = hn::Set(d, kTextureBorder);
  const VF largest = hn::Set(d, kLargestRoundTripPx);
  const VF right = hn::Set(d, static_cast<float>(map.width() - 1));
  const VF bottom = hn::Set(d, static_cast<float>(map.height() - 1));
  const VF u = hn::IfThenElseZero(p.fits, hn::Sub(p.u, border));
  const VF v = hn::IfThenElseZero(p.fits, hn::Sub(p.v, border));
  const VF at_u = hn::Min(hn::Max(hn::Round(u), zero), right);
  const VF at_v = hn::Min(hn::Max(hn::Round(v), zero), bottom);
  const VI index =
      hn::Add(hn::Mul(hn::ConvertTo(di, at_v), hn::Set(di, map.width())), hn::ConvertTo(di, at_u));
  const VF w = hn::GatherIndex(d, map.row(0), index);
  const VF a = hn::GatherIndex(d, s.surface->slope_x.row(0), index);
  const VF b = hn::GatherIndex(d, s.surface->slope_y.row(0), index);
  const VF there = hn::Mul(hn::Set(d, s.surface_scale),
                           hn::MulAdd(a, hn::Sub(u, at_u), hn::MulAdd(b, hn::Sub(v, at_v), w)));
  VF back[3];
  for (int i = 0; i < 3; ++i) {
    const float* m = s.back_m + 3 * i;
    const VF ray =
        hn::MulAdd(hn::Set(d, m[0]), p.u, hn::MulAdd(hn::Set(d, m[1]), p.v, hn::Set(d, m[2])));
    back[i] = hn::MulAdd(there, hn::Set(d, s.back_k[i]), ray);
  }
  const VF inverse = hn::Div(hn::Set(d, 1.0f), back[2]);
  const VF px =
      hn::Add(hn::Set(d, static_cast<float>(g.x) + 0.5f), hn::ConvertTo(d, EverySecond()));
  const VF off_x = hn::MulSub(back[0], inverse, px);
  const VF off_y = hn::MulSub(back[1], inverse, hn::Set(d, static_cast<float>(g.y) + 0.5f));
  const VF error = hn::Sqrt(hn::MulAdd(off_x, off_x, hn::Mul(off_y, off_y)));
  const auto known = hn::And(hn::And(p.fits, hn::Gt(w, zero)),
                             hn::And(hn::Gt(back[2], zero), hn::Lt(error, largest)));
  return hn::IfThenElse(known, error, largest);
}

/// Cost of a plane in one view: photometric, and geometric where the view has a surface.
VF CostInView(const Group& g, const Source& s, size_t view, VF w, VF a, VF b) {
  const DF d;
  const Warp p = LocateAllowed(g, s, view, w, a, b);
  const VF cost = ScoreWindow(g, s, p);
  if (s.surface == nullptr) return cost;
  return hn::MulAdd(hn::Set(d, kCostPerRoundTripPx), RoundTripPx(g, s, p), cost);
}

/// Weighted mean over the views of the pixels a source point moves per unit of inverse depth.
VF DisparityPerInverseDepth(const Group& g, const Level& level, VF w,
                            const float (*weights)[kLanes]) {
  const DF d;
  VF total = hn::Zero(d);
  for (size_t v = 0; v < level.sources.size(); ++v) {
    const Source& s = level.sources[v];
    const VF k0 = hn::Set(d, s.k[0]), k1 = hn::Set(d, s.k[1]), k2 = hn::Set(d, s.k[2]);
    const VF depth = hn::Max(hn::MulAdd(w, k2, hn::Load(d, g.ray[v][2])), hn::Set(d, 1e-6f));
    const VF inverse = hn::Div(hn::Set(d, 1.0f), depth);
    const VF u = hn::Mul(hn::MulAdd(w, k0, hn::Load(d, g.ray[v][0])), inverse);
    const VF y = hn::Mul(hn::MulAdd(w, k1, hn::Load(d, g.ray[v][1])), inverse);
    const VF gu = hn::NegMulAdd(u, k2, k0), gv = hn::NegMulAdd(y, k2, k1);
    const VF length = hn::Mul(inverse, hn::Sqrt(hn::MulAdd(gu, gu, hn::Mul(gv, gv))));
    total = hn::MulAdd(hn::Load(d, weights[v]), length, total);
  }
  return hn::Max(total, hn::Set(d, 1e-6f));
}

}  // namespace dtr::stereo::patchmatch::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
