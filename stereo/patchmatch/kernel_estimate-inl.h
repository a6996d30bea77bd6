// stereo/patchmatch/kernel_estimate-inl.h -- what a pixel's plane is worth. Compiled per
// instruction set: include only from kernel.cpp.
#if defined(DTR_STEREO_PATCHMATCH_KERNEL_ESTIMATE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DTR_STEREO_PATCHMATCH_KERNEL_ESTIMATE_INL_H_
#undef DTR_STEREO_PATCHMATCH_KERNEL_ESTIMATE_INL_H_
#else
#define DTR_STEREO_PATCHMATCH_KERNEL_ESTIMATE_INL_H_
#endif

#include "stereo/patchmatch/kernel_ncc-inl.h"

HWY_BEFORE_NAMESPACE();
namespace dtr::stereo::patchmatch::HWY_NAMESPACE {

/// Variance of a view's noise, and of the reference's, per cost. One, were differences what they
/// seem: but bilinear samples have 0.44 of the noise of pixels in the mean, which the minimum feels
/// whole, as slopes are smoother than noise; and windows give most weight to pixels whose noise is
/// like the centre's (1.1 times the variance at a noise of 2 levels, 1.7 at 6).
constexpr float kNoisePerCost = 1.7f;
/// Step of the parabola and the cost of a view that sees the same surface.
constexpr float kParabolaStepPx = 0.5f;
constexpr float kAgreeingCost = 0.4f;
/// How far, in pixels of disparity, other places that match are looked for, and from where on
/// infinity is another place.
constexpr int kRivalReachPx = 12;
constexpr float kRivalApartPx = 2.0f;
/// Largest cost of a place that matches; places match alike whose costs differ by about this part
/// of the pixel's own cost and what resampling costs. On room, courtyard and plaza 0.2 % of the
/// pixels that are right by a pixel have such a place, and 3 % of the wrong ones.
constexpr float kRivalCost = 0.4f, kRivalNoise = 0.1f, kMinRivalNoise = 0.03f;
/// The first look, at a place not found to a fraction of a pixel yet, may cost so much more.
constexpr float kRivalScoutSlack = 0.15f;
/// Nobody knows where a pixel is when the other places together are this likely against its own.
constexpr float kMaxRivalOdds = 0.5f;
/// Round trips that miss by less end on the same surface.
constexpr float kConsistentPx = 1.0f;

/// Vertex of the parabola through costs at -1, 0, 1; `curvature` is its second derivative.
HWY_INLINE VF Vertex(VF before, VF here, VF after, VF* curvature) {
  const DF d;
  const VF two = hn::Set(d, 2.0f);
  *curvature = hn::Sub(hn::Add(before, after), hn::Mul(two, here));
  const VF safe = hn::Max(*curvature, hn::Set(d, 1e-6f));
  const VF at = hn::Div(hn::Mul(hn::Set(d, 0.5f), hn::Sub(before, after)), safe);
  return hn::Min(hn::Max(at, hn::Set(d, -1.0f)), hn::Set(d, 1.0f));
}

/// What each view says of the pixels' own planes, after passes.
struct Said {
  HWY_ALIGN float cost[kMaxViews][kLanes];    ///< photometric
  HWY_ALIGN float off_px[kMaxViews][kLanes];  ///< RoundTripPx
};

/// Shares of the views in a validation result. After passes, a view counts by how well it agrees,
/// in looks and in place; before, by what the sweeps found.
void WeighViews(const Level& level, const State& state, const Group& g, VF w, VF a, VF b,
                float (*weights)[kLanes], Said* said) {
  const DF d;
  VF largest = hn::Zero(d), sum = hn::Zero(d);
  for (size_t v = 0; v < level.sources.size(); ++v) {
    VF weight = LoadColour(state.weight[v], g.x, g.y);
    if (const Source& s = level.sources[v]; s.surface != nullptr) {
      const Warp p = LocateAllowed(g, s, v, w, a, b);
      const VF photometric = ScoreWindow(g, s, p), off_px = RoundTripPx(g, s, p);
      hn::Store(photometric, d, said->cost[v]);
      hn::Store(off_px, d, said->off_px[v]);
      const VF cost = hn::MulAdd(hn::Set(d, kCostPerRoundTripPx), off_px, photometric);
      weight = hn::Exp(d, hn::Mul(hn::Mul(cost, cost), hn::Set(d, -1.0f / 0.18f)));
    }
    largest = hn::Max(largest, weight);
    hn::Store(weight, d, weights[v]);
  }
  const VF least = hn::Mul(largest, hn::Set(d, kMinWeight));
  for (size_t v = 0; v < level.sources.size(); ++v) {
    const VF weight = hn::Load(d, weights[v]);
    const VF kept = hn::IfThenZeroElse(hn::Lt(weight, least), weight);
    hn::Store(kept, d, weights[v]);
    sum = hn::Add(sum, kept);
  }
  for (size_t v = 0; v < level.sources.size(); ++v) {
    hn::Store(hn::Div(hn::Load(d, weights[v]), sum), d, weights[v]);
  }
}

/// Photometric cost of a plane in those of the views that count into which it falls.
VF MeanScore(const Level& level, const Group& g, const float (*weights)[kLanes], VF w, VF a, VF b) {
  const DF d;
  const VF worst = hn::Set(d, kWorstCost);
  VF total = hn::Zero(d), say = hn::Zero(d);
  for (size_t v = 0; v < level.sources.size(); ++v) {
    const VF weight = hn::Load(d, weights[v]);
    if (hn::AllTrue(d, hn::Eq(weight, hn::Zero(d)))) continue;
    const VF cost = ScoreView(g, level.sources[v], v, w, a, b);
    const VF counts = hn::IfThenElseZero(hn::Lt(cost, worst), weight);
    total = hn::MulAdd(counts, cost, total);
    say = hn::Add(say, counts);
  }
  return hn::IfThenElse(hn::Gt(say, hn::Zero(d)), hn::Div(total, say), worst);
}

/// Least photometric cost within a quarter of a pixel of disparity, `pixel` being the
/// change of inverse depth that is one.
VF LeastScore(const Level& level, const Group& g, const float (*weights)[kLanes], VF w, VF a, VF b,
              VF pixel) {
  const DF d;
  const VF step = hn::Mul(hn::Set(d, 0.25f), pixel);
  const VF before = MeanScore(level, g, weights, hn::Sub(w, step), a, b);
  const VF here = MeanScore(level, g, weights, w, a, b);
  const VF after = MeanScore(level, g, weights, hn::Add(w, step), a, b);
  VF curvature;
  const VF at = Vertex(before, here, after, &curvature);
  // Of the parabola at its vertex, at most a step away.
  const VF slope = hn::Mul(hn::Set(d, 0.5f), hn::Sub(after, before));
  const VF bend = hn::Mul(hn::Set(d, 0.5f), hn::Max(curvature, hn::Zero(d)));
  return hn::Max(hn::Zero(d), hn::MulAdd(at, hn::MulAdd(bend, at, slope), here));
}

/// The view that has the most say in a group.
size_t LoudestView(const Level& level, const float (*weights)[kLanes]) {
  size_t loudest = 0;
  float most = -1;
  for (size_t v = 0; v < level.sources.size(); ++v) {
    const float say = hn::GetLane(hn::SumOfLanes(DF(), hn::Load(DF(), weights[v])));
    if (say > most) most = say, loudest = v;
  }
  return loudest;
}

/// Odds that the pixel lies at another place that costs `cost`, where `asked` says so.
VF RivalOdds(VF own, VF cost, hn::Mask<DF> asked) {
  const DF d;
  const VF noise = hn::MulAdd(hn::Set(d, kRivalNoise), own, hn::Set(d, kMinRivalNoise));
  const VF more = hn::Max(hn::Div(hn::Sub(cost, own), noise), hn::Set(d, -20.0f));
  return hn::IfThenElseZero(hn::And(asked, hn::Lt(cost, hn::Set(d, kRivalCost))),
                            hn::Exp(d, hn::Neg(more)));
}

/// Looks for other places on the pixels' rays that match as well: valleys of the cost in the view
/// with the most say, up to kRivalReachPx away, and infinity, where all lies that the range leaves
/// out behind it: mirrored things, and everything in photos that are copies of one another. They
/// are then held to all views that count. Returns the odds of all these places together against the
/// pixel's own.
VF RivalsOdds(const Level& level, const Group& g, const float (*weights)[kLanes], VF w, VF a, VF b,
              VF px, VF own) {
  const DF d;
  const VF zero = hn::Zero(d);
  // What is much worse in one view is not as good in all.
  const VF limit = hn::Min(hn::Set(d, kRivalCost), hn::Add(own, hn::Set(d, kRivalScoutSlack)));
  VF odds = zero;
  const size_t scout = LoudestView(level, weights);
  const Source& s = level.sources[scout];
  const VF step = hn::Div(hn::Set(d, 1.0f), px);
  for (const float side : {-1.0f, 1.0f}) {
    VF before = zero, here = zero;  // no valley at the first two steps: that is the own one
    for (int k = 1; k <= kRivalReachPx + 1; ++k) {
      const VF moved = hn::MulAdd(hn::Set(d, side * static_cast<float>(k)), step, w);
      const VF after = ScoreView(g, s, scout, moved, a, b);
      auto valley = hn::And(hn::Lt(here, before), hn::Le(here, after));
      valley = hn::And(valley, hn::Ge(moved, zero));
      if (!hn::AllFalse(d, valley)) {
        VF curvature;
        const VF at = Vertex(before, here, after, &curvature);
        const VF away = hn::Mul(hn::Mul(step, hn::Set(d, side)),
                                hn::Add(hn::Set(d, static_cast<float>(k - 1)), at));
        const VF hypothesis = hn::Add(w, away);
        valley = hn::And(valley, hn::Lt(ScoreView(g, s, scout, hypothesis, a, b), limit));
        if (!hn::AllFalse(d, valley)) {
          const VF cost = LeastScore(level, g, weights, hypothesis, a, b, step);
          odds = hn::Add(odds, RivalOdds(own, cost, valley));
        }
      }
      before = here;
      here = after;
    }
  }
  const auto apart = hn::Gt(hn::Mul(w, px), hn::Set(d, kRivalApartPx));
  const VF far = ScoreView(g, s, scout, zero, zero, zero);
  const auto maybe = hn::And(apart, hn::Lt(far, limit));
  if (!hn::AllFalse(d, maybe)) {
    const VF cost = MeanScore(level, g, weights, zero, zero, zero);
    odds = hn::Add(odds, RivalOdds(own, cost, maybe));
  }
  return odds;
}

/// Whether any pixel of a group is wanted.
bool AnyWanted(const float* wanted, int x, int width) {
  for (int i = 0; i < static_cast<int>(kLanes) && x + 2 * i < width; ++i) {
    if (wanted[x + 2 * i] != 0) return true;
  }
  return false;
}

/// See AmbiguousRow.
void AmbiguousRowImpl(const Level& level, const State& state, int y, const float* wanted,
                      std::uint8_t* ambiguous) {
  const DF d;
  const int width = level.reference.width;
  HWY_ALIGN float weights[kMaxViews][kLanes];
  HWY_ALIGN float odds[kLanes];
  Said said;
  Group g;
  for (int x = 0; x < width; x += 2 * static_cast<int>(kLanes)) {
    if (wanted != nullptr && !AnyWanted(wanted, x, width)) continue;
    PrepareGroup(level, x, y, &g);
    const VF w = LoadColour(state.w, x, y);
    const VF a = LoadColour(state.a, x, y), b = LoadColour(state.b, x, y);
    WeighViews(level, state, g, w, a, b, weights, &said);
    const VF px = DisparityPerInverseDepth(g, level, w, weights);
    const VF own = MeanScore(level, g, weights, w, a, b);
    hn::Store(RivalsOdds(level, g, weights, w, a, b, px, own), d, odds);
    for (int i = 0; i < static_cast<int>(kLanes) && x + 2 * i < width; ++i) {
      ambiguous[x / 2 + i] = odds[i] > kMaxRivalOdds;
    }
  }
}

/// What the views that agree say of a minimum. The others have no certainty.
struct Witnesses {
  size_t count = 0;
  HWY_ALIGN float weight[kMaxViews][kLanes];     ///< share in the common cost
  HWY_ALIGN float certainty[kMaxViews][kLanes];  ///< weight times curvature
  HWY_ALIGN float vertex[kMaxViews][kLanes];     ///< the view's own minimum, steps
  /// Unit vector along which a change of inverse depth moves the view's image, in pixels of the
  /// reference: noise of the reference pulls views with opposite baselines to opposite sides.
  HWY_ALIGN float along_x[kMaxViews][kLanes];
  HWY_ALIGN float along_y[kMaxViews][kLanes];

  HWY_INLINE void Clear(size_t view) {
    for (auto* of : {weight, certainty, vertex, along_x, along_y})
      hn::Store(hn::Zero(DF()), DF(), of[view]);
  }
};

void StoreDirection(const Group& g, const Source& s, size_t view, VF w, VF a, VF b,
                    Witnesses* views) {
  const DF d;
  const Warp p = Locate(g, s, view, w, a, b);
  const VF u = hn::NegMulAdd(p.u, hn::Set(d, s.k[2]), hn::Set(d, s.k[0]));
  const VF v = hn::NegMulAdd(p.v, hn::Set(d, s.k[2]), hn::Set(d, s.k[1]));
  // By the inverse of the window's change, times its determinant, which is positive.
  const VF x = hn::MulSub(p.vy, u, hn::Mul(p.uy, v)), y = hn::MulSub(p.ux, v, hn::Mul(p.vx, u));
  const VF length = hn::Sqrt(hn::MulAdd(x, x, hn::Mul(y, y)));
  const auto any = hn::And(hn::Gt(length, hn::Zero(d)), hn::Lt(length, hn::Set(d, 1e30f)));
  hn::Store(hn::IfThenElseZero(any, hn::Div(x, length)), d, views->along_x[view]);
  hn::Store(hn::IfThenElseZero(any, hn::Div(y, length)), d, views->along_y[view]);
}

/// Mean square of the steps between the views' own minima and the common one, weighted like that.
VF SpreadOf(const Witnesses& views, VF at) {
  const DF d;
  VF spread = hn::Zero(d), sum = hn::Zero(d);
  for (size_t v = 0; v < views.count; ++v) {
    const VF off = hn::Sub(hn::Load(d, views.vertex[v]), at);
    const VF c = hn::Load(d, views.certainty[v]);
    spread = hn::MulAdd(c, hn::Mul(off, off), spread);
    sum = hn::Add(sum, c);
  }
  return hn::Div(spread, hn::Max(sum, hn::Set(d, 1e-6f)));
}

/// Variance of the common minimum by the photos' noise, squared steps. Weighted least squares: a
/// cost c is half the mean of squared differences of normalised patches, so the minimum of one
/// view's has a variance of 2 c sum(weight^2) / c'', times kNoisePerCost. Half of it is noise of
/// the view's own, half of the reference, which all views share: their minima add up as vectors.
/// For c stands the common cost of all views that count: that of one view is mostly chance.
VF VarianceByNoise(const Group& g, VF cost, VF curvature, const Witnesses& views) {
  const DF d;
  const VF zero = hn::Zero(d), least = hn::Set(d, 1e-9f);
  VF sum = zero, own = zero, across = zero, down = zero;
  for (size_t v = 0; v < views.count; ++v) sum = hn::Add(sum, hn::Load(d, views.certainty[v]));
  for (size_t v = 0; v < views.count; ++v) {
    const VF certainty = hn::Load(d, views.certainty[v]), weight = hn::Load(d, views.weight[v]);
    const VF share = hn::Div(certainty, hn::Max(sum, least));
    const VF off = hn::Sqrt(hn::Div(weight, hn::Max(certainty, least)));  // 1 / sqrt(c'')
    const VF part = hn::IfThenElseZero(hn::Gt(certainty, zero), hn::Mul(share, off));
    own = hn::MulAdd(part, part, own);
    across = hn::MulAdd(part, hn::Load(d, views.along_x[v]), across);
    down = hn::MulAdd(part, hn::Load(d, views.along_y[v]), down);
  }
  const VF together = hn::MulAdd(across, across, hn::MulAdd(down, down, own));
  const VF flat = hn::Div(hn::Set(d, 2.0f), hn::Max(curvature, hn::Set(d, 1e-6f)));
  const VF per_variance = hn::IfThenElse(hn::Gt(sum, zero), together, flat);
  const VF samples = hn::Load(d, g.squared_weights);
  return hn::Mul(hn::Mul(hn::Set(d, kNoisePerCost), hn::Mul(samples, cost)), per_variance);
}

void EstimateGroup(const Level& level, const State& state, const Group& g, PixelEstimate* out) {
  const DF d;
  const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  HWY_ALIGN float weights[kMaxViews][kLanes];
  const VF w = LoadColour(state.w, g.x, g.y), a = LoadColour(state.a, g.x, g.y);
  const VF b = LoadColour(state.b, g.x, g.y);
  Said said;
  WeighViews(level, state, g, w, a, b, weights, &said);
  const VF px = DisparityPerInverseDepth(g, level, w, weights);
  const VF step = hn::Div(hn::Set(d, kParabolaStepPx), px);
  VF before = zero, here = zero, after = zero, agreeing = zero, consistent = zero;
  Witnesses views;
  views.count = level.sources.size();
  for (size_t v = 0; v < level.sources.size(); ++v) {
    const Source& s = level.sources[v];
    const VF weight = hn::Load(d, weights[v]);
    if (s.surface != nullptr) {
      const auto is_near = hn::Lt(hn::Load(d, said.off_px[v]), hn::Set(d, kConsistentPx));
      consistent = hn::Add(consistent, hn::IfThenElseZero(is_near, one));
    }
    views.Clear(v);
    const auto counts = hn::Gt(weight, zero);
    if (hn::AllFalse(d, counts)) continue;
    const VF c0 = ScoreView(g, s, v, hn::Sub(w, step), a, b);
    const VF c1 = s.surface != nullptr ? hn::Load(d, said.cost[v]) : ScoreView(g, s, v, w, a, b);
    const VF c2 = ScoreView(g, s, v, hn::Add(w, step), a, b);
    before = hn::MulAdd(weight, c0, before);
    here = hn::MulAdd(weight, c1, here);
    after = hn::MulAdd(weight, c2, after);
    VF curvature;
    const VF at = Vertex(c0, c1, c2, &curvature);
    const auto agrees =
        hn::And(counts, hn::And(hn::Lt(c1, hn::Set(d, kAgreeingCost)), hn::Gt(curvature, zero)));
    agreeing = hn::Add(agreeing, hn::IfThenElseZero(agrees, one));
    hn::Store(at, d, views.vertex[v]);
    StoreDirection(g, s, v, w, a, b, &views);
    hn::Store(hn::IfThenElseZero(agrees, hn::Mul(weight, curvature)), d, views.certainty[v]);
    hn::Store(weight, d, views.weight[v]);
  }
  VF curvature;
  const VF at = Vertex(before, here, after, &curvature);
  const VF spread = hn::Div(SpreadOf(views, at), hn::Max(agreeing, one));
  const VF variance = hn::Add(VarianceByNoise(g, here, curvature, views), spread);
  const VF sigma = hn::Mul(step, hn::Sqrt(variance));
  HWY_ALIGN float lanes[6][kLanes];
  hn::Store(consistent, d, lanes[5]);
  hn::Store(hn::MulAdd(step, at, w), d, lanes[0]);
  hn::Store(sigma, d, lanes[1]);
  hn::Store(here, d, lanes[2]);
  hn::Store(px, d, lanes[3]);
  hn::Store(agreeing, d, lanes[4]);
  for (int i = 0; i < static_cast<int>(kLanes) && g.x + 2 * i < level.reference.width; ++i) {
    out[g.x + 2 * i] = {lanes[0][i],
                        lanes[1][i],
                        lanes[2][i],
                        lanes[3][i],
                        g.texture[i],
                        static_cast<int>(lanes[4][i]),
                        static_cast<int>(lanes[5][i])};
  }
}

void EstimateRowImpl(const Level& level, const State& state, int y, const float* wanted,
                     PixelEstimate* out) {
  Group g;
  for (int start = 0; start < 2; ++start) {
    for (int x = start; x < level.reference.width; x += 2 * static_cast<int>(kLanes)) {
      if (wanted != nullptr && !AnyWanted(wanted, x, level.reference.width)) continue;
      PrepareGroup(level, x, y, &g);
      EstimateGroup(level, state, g, out);
    }
  }
}

}  // namespace dtr::stereo::patchmatch::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
