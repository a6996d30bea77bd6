#include "stereo/patchmatch/kernel.h"

#include <cmath>
#include <limits>

#include "dtr/base/random.h"

// The rest of this file is compiled once per instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stereo/patchmatch/kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format off: after highway.h
#include <hwy/contrib/math/math-inl.h>

#include "stereo/patchmatch/kernel_candidates-inl.h"
#include "stereo/patchmatch/kernel_estimate-inl.h"
#include "stereo/patchmatch/kernel_ncc-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace dtr::stereo::patchmatch::HWY_NAMESPACE {

/// A view sees a pixel when more than this many candidates match well in it and fewer than that
/// badly. ACMH's 2 and 3 take the observation from all views next to silhouettes and behind thin
/// things.
constexpr float kGoodPlanes = 1.0f, kBadPlanes = 7.0f;
/// What a first guess costs more when one view alone speaks for it. By the mean of two a surface
/// that a single neighbour sees is never found, and no later step looks for it: fountain's far
/// facade, 27.3 dB held out instead of 28.0. Without any surcharge chance decides more often.
constexpr float kLoneView = 0.1f;

/// A sum so far above a limit is above it in whatever order it is summed up.
constexpr float kSurelyAbove = 1.0001f;

/// Best plane so far, and the views' weights.
struct Best {
  HWY_ALIGN float w[kLanes];
  HWY_ALIGN float a[kLanes];
  HWY_ALIGN float b[kLanes];
  HWY_ALIGN float cost[kLanes];
  HWY_ALIGN float weight[kMaxViews][kLanes];
  int used = 0;            ///< views with a say at any of the pixels
  size_t view[kMaxViews];  ///< which, that with most say first
};

/// Stores lanes whose pixel lies in the image.
HWY_INLINE void StoreColour(VF value, int x, int y, int width, BorderedGrid* grid) {
  HWY_ALIGN float lanes[kLanes];
  hn::Store(value, DF(), lanes);
  float* row = grid->at(0, y);
  for (int i = 0; i < static_cast<int>(kLanes) && x + 2 * i < width; ++i) row[x + 2 * i] = lanes[i];
}

/// Whether work on a group is of no use: none of its pixels is open.
HWY_INLINE bool AllSettled(const Level& level, int x, int y) {
  return level.open && hn::AllFalse(DF(), hn::Gt(LoadColour(*level.open, x, y), hn::Zero(DF())));
}

/// Stores lanes whose pixel lies in the image and is open.
HWY_INLINE void StoreOpen(const Level& level, VF value, int x, int y, BorderedGrid* grid) {
  if (level.open) {
    const auto open = hn::Gt(LoadColour(*level.open, x, y), hn::Zero(DF()));
    value = hn::IfThenElse(open, value, LoadColour(*grid, x, y));
  }
  StoreColour(value, x, y, level.reference.width, grid);
}

/// What the neighbours think of a view: their mean weight, in units of an equal share, up to 1.
HWY_INLINE VF PriorOf(const State& state, const Group& g, size_t view) {
  const DF d;
  const BorderedGrid& w = state.weight[view];
  const VF sum = hn::Add(hn::Add(LoadColour(w, g.x, g.y - 1), LoadColour(w, g.x, g.y + 1)),
                         hn::Add(LoadColour(w, g.x - 1, g.y), LoadColour(w, g.x + 1, g.y)));
  const float equal = 0.25f * static_cast<float>(state.weight.size());
  return hn::Min(hn::Set(d, 1.0f), hn::Mul(sum, hn::Set(d, equal)));
}

/// Costs of all candidates in a view, and how well it sees the pixel: a view in which several
/// candidates match well and few match badly does (ACMH's joint view selection without its
/// sampling). From 0 to 1.
VF CompareInView(const Level& level, const Sweep& sweep, const Group& g, size_t view,
                 Candidates* c) {
  const DF d;
  const VF w_min = hn::Set(d, level.w_min), w_max = hn::Set(d, level.w_max);
  const float age = static_cast<float>(sweep.iteration);
  const float tau = 0.8f * std::exp(-age * age / 90.0f);
  const VF good_below = hn::Set(d, tau), bad_above = hn::Set(d, 1.2f);
  const VF one = hn::Set(d, 1.0f), zero = hn::Zero(d);
  VF good = zero, bad = zero, score = zero;
  for (int n = 0; n < c->count; ++n) {
    const VF w = hn::Load(d, c->w[n]);
    const auto outside = hn::Or(hn::Lt(w, w_min), hn::Gt(w, w_max));
    VF cost =
        CostInView(g, level.sources[view], view, w, hn::Load(d, c->a[n]), hn::Load(d, c->b[n]));
    cost = hn::IfThenElse(outside, hn::Set(d, kWorstCost), cost);
    cost = hn::IfThenElse(hn::Eq(w, w), cost, hn::Set(d, kNothing));
    hn::Store(cost, d, c->cost[n][view]);
    const auto is_good = hn::Lt(cost, good_below);
    good = hn::Add(good, hn::IfThenElseZero(is_good, one));
    bad = hn::Add(bad, hn::IfThenElseZero(hn::Gt(cost, bad_above), one));
    const VF e = hn::Exp(d, hn::Mul(hn::Mul(cost, cost), hn::Set(d, -1.0f / 0.18f)));
    score = hn::Add(score, hn::IfThenElseZero(is_good, e));
  }
  const auto sees =
      hn::And(hn::Gt(good, hn::Set(d, kGoodPlanes)), hn::Lt(bad, hn::Set(d, kBadPlanes)));
  return hn::IfThenElse(sees, hn::Div(score, hn::Max(good, one)),
                        hn::Set(d, std::exp(-tau * tau / 0.32f)));
}

/// Weights of the views: how well they see the pixel times what the neighbours think. Views the
/// neighbours think most of come first; what these leave no say, however well it may see, is not
/// looked at.
void ChooseViews(const Level& level, const Sweep& sweep, const State& state, const Group& g,
                 Candidates* c, Best* best) {
  const DF d;
  const size_t views = level.sources.size();
  HWY_ALIGN float most[kMaxViews][kLanes];
  float thought[kMaxViews];
  size_t order[kMaxViews];
  for (size_t v = 0; v < views; ++v) {
    const VF largest = hn::MulAdd(PriorOf(state, g, v), hn::Set(d, 0.8f), hn::Set(d, 0.1f));
    hn::Store(largest, d, most[v]);
    thought[v] = hn::GetLane(hn::SumOfLanes(d, largest));
    size_t i = v;
    for (; i > 0 && thought[order[i - 1]] < thought[v]; --i) order[i] = order[i - 1];
    order[i] = v;
  }
  const VF share = hn::Set(d, kMinWeight);
  VF largest = hn::Zero(d);
  for (size_t i = 0; i < views; ++i) {
    const size_t v = order[i];
    const VF bound = hn::Load(d, most[v]);
    VF weight = hn::Zero(d);
    if (!hn::AllTrue(d, hn::Lt(bound, hn::Mul(largest, share)))) {
      weight = hn::Mul(CompareInView(level, sweep, g, v, c), bound);
    }
    largest = hn::Max(largest, weight);
    hn::Store(weight, d, best->weight[v]);
  }
  const VF least = hn::Mul(largest, share);
  VF sum = hn::Zero(d);
  for (size_t v = 0; v < views; ++v) {
    VF weight = hn::Load(d, best->weight[v]);
    weight = hn::IfThenZeroElse(hn::Lt(weight, least), weight);
    hn::Store(weight, d, best->weight[v]);
    sum = hn::Add(sum, weight);
  }
  best->used = 0;
  for (size_t v = 0; v < views; ++v) {
    const VF weight = hn::Div(hn::Load(d, best->weight[v]), sum);
    hn::Store(weight, d, best->weight[v]);
    thought[v] = hn::GetLane(hn::SumOfLanes(d, weight));
    if (hn::AllTrue(d, hn::Eq(weight, hn::Zero(d)))) continue;
    int i = best->used++;
    for (; i > 0 && thought[best->view[i - 1]] < thought[v]; --i) {
      best->view[i] = best->view[i - 1];
    }
    best->view[i] = v;
  }
}

/// Weighted mean cost of a plane; where no lane can get below `limit`, it may be any cost above.
/// The views with most say come first, but the mean is summed up in one order for all groups.
VF TotalCost(const Level& level, const Group& g, const Best& best, VF w, VF a, VF b, VF limit) {
  const DF d;
  HWY_ALIGN float part[kMaxViews][kLanes];
  for (size_t v = 0; v < level.sources.size(); ++v) hn::Store(hn::Zero(d), d, part[v]);
  const VF enough = hn::Mul(limit, hn::Set(d, kSurelyAbove));
  VF so_far = hn::Zero(d);
  for (int i = 0; i < best.used; ++i) {
    const size_t v = best.view[i];
    const VF cost = CostInView(g, level.sources[v], v, w, a, b);
    const VF weighted = hn::Mul(hn::Load(d, best.weight[v]), cost);
    hn::Store(weighted, d, part[v]);
    so_far = hn::Add(so_far, weighted);
    if (hn::AllTrue(d, hn::Ge(so_far, enough))) return so_far;
  }
  VF total = hn::Zero(d);
  for (size_t v = 0; v < level.sources.size(); ++v) total = hn::Add(total, hn::Load(d, part[v]));
  return total;
}

/// Cost of missing the expected depth: the negative logarithm of a normal distribution over a
/// constant, bounded, so that photos that contradict what is expected win (Welsch's loss; Xu and
/// Tao, AAAI 2020, eq. 6, have the same mixture for planes between matched points).
VF Unexpected(const Level& level, const Group& g, VF w) {
  const DF d;
  if (!level.expected) return hn::Zero(d);
  const VF off = hn::Mul(hn::Sub(w, LoadColour(level.expected->w, g.x, g.y)),
                         LoadColour(level.expected->inverse_sigma, g.x, g.y));
  const VF likely = hn::Exp(d, hn::Mul(hn::Set(d, -0.5f), hn::Mul(off, off)));
  const VF weak = hn::Set(d, kWeakTexture);
  const VF most =
      hn::Div(hn::Mul(hn::Set(d, kUnexpectedCost), weak), hn::Add(weak, hn::Load(d, g.texture)));
  return hn::Mul(most, hn::Sub(hn::Set(d, 1.0f), likely));
}

/// Takes a plane, put into the range, where it costs less.
void TryPlane(const Level& level, const Group& g, VF w, VF a, VF b, Best* best) {
  const DF d;
  w = hn::Min(hn::Max(w, hn::Set(d, level.w_min)), hn::Set(d, level.w_max));
  const VF limit = hn::Load(d, best->cost);
  const VF cost = hn::Add(TotalCost(level, g, *best, w, a, b, limit), Unexpected(level, g, w));
  const auto less = hn::Lt(cost, limit);
  hn::Store(hn::IfThenElse(less, cost, limit), d, best->cost);
  hn::Store(hn::IfThenElse(less, w, hn::Load(d, best->w)), d, best->w);
  hn::Store(hn::IfThenElse(less, a, hn::Load(d, best->a)), d, best->a);
  hn::Store(hn::IfThenElse(less, b, hn::Load(d, best->b)), d, best->b);
}

/// New view weights, then the cheapest candidate.
void ChooseJointly(const Level& level, const Sweep& sweep, const State& state, const Group& g,
                   Candidates* c, Best* best) {
  const DF d;
  ChooseViews(level, sweep, state, g, c, best);
  hn::Store(hn::Set(d, std::numeric_limits<float>::infinity()), d, best->cost);
  for (int n = 0; n < c->count; ++n) {
    VF total = hn::Zero(d);
    for (size_t v = 0; v < level.sources.size(); ++v) {
      const VF weight = hn::Load(d, best->weight[v]);
      const VF part = hn::Mul(weight, hn::Load(d, c->cost[n][v]));
      total = hn::Add(total, hn::IfThenZeroElse(hn::Eq(weight, hn::Zero(d)), part));
    }
    total = hn::Add(total, Unexpected(level, g, hn::Load(d, c->w[n])));
    const VF old = hn::Load(d, best->cost);
    const auto less = hn::Lt(total, old);
    hn::Store(hn::IfThenElse(less, total, old), d, best->cost);
    hn::Store(hn::IfThenElse(less, hn::Load(d, c->w[n]), hn::Load(d, best->w)), d, best->w);
    hn::Store(hn::IfThenElse(less, hn::Load(d, c->a[n]), hn::Load(d, best->a)), d, best->a);
    hn::Store(hn::IfThenElse(less, hn::Load(d, c->b[n]), hn::Load(d, best->b)), d, best->b);
  }
}

/// Three uniform numbers in [-1, 1) per lane, named by pixel and use.
void Draw(const Level& level, const Group& g, int number, int use, float (*out)[kLanes]) {
  for (size_t i = 0; i < kLanes; ++i) {
    const std::uint64_t bits =
        HashOf(level.seed, g.x + 2 * static_cast<int>(i), g.y, static_cast<int>(number * 16 + use));
    for (int k = 0; k < 3; ++k) {
      const auto part = static_cast<std::int32_t>((bits >> (21 * k)) & 0x1fffff);
      out[k][i] = static_cast<float>(part) * 0x1.0p-20f - 1.0f;
    }
  }
}

/// The plane through the four direct neighbours, then random changes of the best plane.
void Refine(const Level& level, const Sweep& sweep, const State& state, const Group& g,
            Best* best) {
  const DF d;
  const VF half = hn::Set(d, 0.5f);
  const VF left = LoadColour(state.w, g.x - 1, g.y), right = LoadColour(state.w, g.x + 1, g.y);
  const VF up = LoadColour(state.w, g.x, g.y - 1), down = LoadColour(state.w, g.x, g.y + 1);
  if (g.y > 0 && g.y + 1 < level.reference.height) {
    TryPlane(level, g, hn::Load(d, best->w), hn::Mul(half, hn::Sub(right, left)),
             hn::Mul(half, hn::Sub(down, up)), best);
  }
  const VF px = DisparityPerInverseDepth(g, level, hn::Load(d, best->w), best->weight);
  const VF step = hn::Div(hn::Set(d, sweep.step_px), px);
  // A slope that moves the window's corner as far as `step` moves its centre.
  const VF slope = hn::Mul(step, hn::Set(d, 1.0f / kRadius));
  HWY_ALIGN float r[3][kLanes];
  Draw(level, g, sweep.number, 0, r);
  const VF w0 = hn::Load(d, best->w), a0 = hn::Load(d, best->a), b0 = hn::Load(d, best->b);
  if (sweep.move) TryPlane(level, g, hn::MulAdd(step, hn::Load(d, r[0]), w0), a0, b0, best);
  const VF w1 = hn::Load(d, best->w), a1 = hn::Load(d, best->a), b1 = hn::Load(d, best->b);
  TryPlane(level, g, w1, hn::MulAdd(slope, hn::Load(d, r[1]), a1),
           hn::MulAdd(slope, hn::Load(d, r[2]), b1), best);
  Draw(level, g, sweep.number, 1, r);
  const VF quarter = hn::Set(d, 0.25f);
  const VF w2 = hn::Load(d, best->w), a2 = hn::Load(d, best->a), b2 = hn::Load(d, best->b);
  TryPlane(level, g, hn::MulAdd(hn::Mul(quarter, step), hn::Load(d, r[0]), w2),
           hn::MulAdd(hn::Mul(quarter, slope), hn::Load(d, r[1]), a2),
           hn::MulAdd(hn::Mul(quarter, slope), hn::Load(d, r[2]), b2), best);
  if (!sweep.jump) return;
  Draw(level, g, sweep.number, 2, r);
  const float mid = 0.5f * (level.w_min + level.w_max), span = 0.5f * (level.w_max - level.w_min);
  const VF w3 = hn::MulAdd(hn::Load(d, r[0]), hn::Set(d, span), hn::Set(d, mid));
  const VF tilt = hn::Div(hn::Set(d, 1.0f), px);
  TryPlane(level, g, w3, hn::Mul(tilt, hn::Load(d, r[1])), hn::Mul(tilt, hn::Load(d, r[2])), best);
}

std::int64_t SweepRowImpl(const Level& level, const Sweep& sweep, int y, State* state) {
  const DF d;
  const int width = level.reference.width;
  Candidates candidates;
  Best best;
  Group g;
  for (int x = (y + sweep.colour) % 2; x < width; x += 2 * static_cast<int>(kLanes)) {
    if (AllSettled(level, x, y)) continue;
    PrepareGroup(level, x, y, &g);
    CollectCandidates(level, *state, g, sweep.far_regions, &candidates);
    ChooseJointly(level, sweep, *state, g, &candidates, &best);
    Refine(level, sweep, *state, g, &best);
    StoreOpen(level, hn::Load(d, best.w), x, y, &state->w);
    StoreOpen(level, hn::Load(d, best.a), x, y, &state->a);
    StoreOpen(level, hn::Load(d, best.b), x, y, &state->b);
    StoreOpen(level, hn::Load(d, best.cost), x, y, &state->cost);
    for (size_t v = 0; v < level.sources.size(); ++v) {
      StoreOpen(level, hn::Load(d, best.weight[v]), x, y, &state->weight[v]);
    }
  }
  return g.samples;
}

void ExpectRowImpl(const Level& level, int y, State* state) {
  const DF d;
  const int width = level.reference.width;
  const size_t views = level.sources.size();
  const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  HWY_ALIGN float trusted[kMaxViews][kLanes];
  Group g;
  for (int start = 0; start < 2; ++start) {
    for (int x = start; x < width; x += 2 * static_cast<int>(kLanes)) {
      if (AllSettled(level, x, y)) continue;
      PlaceGroup(level, x, y, &g);
      const VF w = LoadColour(state->w, x, y);
      const VF a = LoadColour(state->a, x, y), b = LoadColour(state->b, x, y);
      VF sum = zero;
      for (size_t v = 0; v < views; ++v) {
        const Source& s = level.sources[v];
        VF trust = one;
        if (s.surface != nullptr) {
          const VF off_px = RoundTripPx(g, s, LocateAllowed(g, s, v, w, a, b));
          trust = hn::IfThenElseZero(hn::Lt(off_px, hn::Set(d, kLargestRoundTripPx)), one);
        }
        hn::Store(trust, d, trusted[v]);
        sum = hn::Add(sum, trust);
      }
      const auto any = hn::Gt(sum, zero);
      const VF equal = hn::Set(d, 1.0f / static_cast<float>(views));
      for (size_t v = 0; v < views; ++v) {
        const VF share = hn::Div(hn::Load(d, trusted[v]), hn::Max(sum, one));
        StoreColour(hn::IfThenElse(any, share, equal), x, y, width, &state->weight[v]);
      }
    }
  }
}

std::int64_t SearchRowImpl(const Level& level, int samples, int y, State* state) {
  const DF d;
  const int width = level.reference.width;
  const size_t views = level.sources.size();
  const VF infinity = hn::Set(d, std::numeric_limits<float>::infinity());
  const VF half = hn::Set(d, 0.5f);
  HWY_ALIGN float r[3][kLanes];
  HWY_ALIGN float equal[kMaxViews][kLanes];
  for (auto& lanes : equal) hn::Store(hn::Set(d, 1.0f / static_cast<float>(views)), d, lanes);
  Group g;
  for (int x = (y + kGuessedColour) % 2; x < width; x += 2 * static_cast<int>(kLanes)) {
    if (AllSettled(level, x, y)) continue;
    PrepareGroup(level, x, y, &g);
    VF best = infinity, best_w = hn::Set(d, level.w_min);
    VF best_a = hn::Zero(d), best_b = hn::Zero(d);
    for (int n = 0; n < samples; ++n) {
      Draw(level, g, n, 15, r);
      const float cell = (level.w_max - level.w_min) / static_cast<float>(samples);
      const float centre = level.w_min + cell * (static_cast<float>(n) + 0.5f);
      const VF w = hn::MulAdd(hn::Load(d, r[0]), hn::Set(d, 0.5f * cell), hn::Set(d, centre));
      const VF px = DisparityPerInverseDepth(g, level, w, equal);
      const VF tilt = hn::Div(hn::Set(d, n % 2 == 0 ? 0.0f : 1.0f), px);
      const VF a = hn::Mul(tilt, hn::Load(d, r[1])), b = hn::Mul(tilt, hn::Load(d, r[2]));
      VF first = hn::Set(d, kWorstCost), second = first;
      for (size_t v = 0; v < views; ++v) {
        const VF cost = ScoreView(g, level.sources[v], v, w, a, b);
        second = hn::Min(second, hn::Max(first, cost));
        first = hn::Min(first, cost);
      }
      const VF mean = views == 1 ? first : hn::Mul(half, hn::Add(first, second));
      const VF cost =
          hn::Add(hn::Min(mean, hn::Add(first, hn::Set(d, kLoneView))), Unexpected(level, g, w));
      const auto less = hn::Lt(cost, best);
      best = hn::IfThenElse(less, cost, best);
      best_w = hn::IfThenElse(less, w, best_w);
      best_a = hn::IfThenElse(less, a, best_a);
      best_b = hn::IfThenElse(less, b, best_b);
    }
    StoreOpen(level, best_w, x, y, &state->w);
    StoreOpen(level, best_a, x, y, &state->a);
    StoreOpen(level, best_b, x, y, &state->b);
    StoreOpen(level, best, x, y, &state->cost);
    for (size_t v = 0; v < views; ++v) {
      StoreOpen(level, hn::Load(d, equal[v]), x, y, &state->weight[v]);
    }
  }
  return g.samples;
}

const char* TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace dtr::stereo::patchmatch::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace dtr::stereo::patchmatch {

HWY_EXPORT(SearchRowImpl);
HWY_EXPORT(SweepRowImpl);
HWY_EXPORT(ScoreRowImpl);
HWY_EXPORT(ExpectRowImpl);
HWY_EXPORT(EstimateRowImpl);
HWY_EXPORT(AmbiguousRowImpl);
HWY_EXPORT(TargetName);

std::int64_t SearchRow(const Level& level, int samples, int y, State* state) {
  return HWY_DYNAMIC_DISPATCH(SearchRowImpl)(level, samples, y, state);
}
std::int64_t SweepRow(const Level& level, const Sweep& sweep, int y, State* state) {
  return HWY_DYNAMIC_DISPATCH(SweepRowImpl)(level, sweep, y, state);
}
void ExpectRow(const Level& level, int y, State* state) {
  HWY_DYNAMIC_DISPATCH(ExpectRowImpl)(level, y, state);
}
std::int64_t ScoreRow(const Level& level, const State& state, int y, std::span<const float> steps,
                      float* costs) {
  return HWY_DYNAMIC_DISPATCH(ScoreRowImpl)(level, state, y, steps, costs);
}
void EstimateRow(const Level& level, const State& state, int y, const float* wanted,
                 PixelEstimate* out) {
  HWY_DYNAMIC_DISPATCH(EstimateRowImpl)(level, state, y, wanted, out);
}
void AmbiguousRow(const Level& level, const State& state, int y, const float* wanted,
                  std::uint8_t* ambiguous) {
  HWY_DYNAMIC_DISPATCH(AmbiguousRowImpl)(level, state, y, wanted, ambiguous);
}
const char* InstructionSet() { return HWY_DYNAMIC_DISPATCH(TargetName)(); }

}  // namespace dtr::stereo::patchmatch
#endif
