// stereo/patchmatch/kernel_candidates-inl.h -- planes that a pixel may take over: its own, those of
// the cheapest pixels around it (Xu and Tao 2019, sec. 3.1) and what else suggests one. Compiled
// per instruction set: include only from kernel.cpp.
#if defined(DTR_STEREO_PATCHMATCH_KERNEL_CANDIDATES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DTR_STEREO_PATCHMATCH_KERNEL_CANDIDATES_INL_H_
#undef DTR_STEREO_PATCHMATCH_KERNEL_CANDIDATES_INL_H_
#else
#define DTR_STEREO_PATCHMATCH_KERNEL_CANDIDATES_INL_H_
#endif

#include "stereo/patchmatch/kernel_ncc-inl.h"

HWY_BEFORE_NAMESPACE();
namespace dtr::stereo::patchmatch::HWY_NAMESPACE {

/// Candidates per visit: the pixel's own plane, 4 near and 4 far regions, 3 suggested.
constexpr int kPlanes = 12;
constexpr int kNearSamples = 7, kFarSamples = 11;

/// Inverse depth and cost of a candidate that a lane does not have, for its neighbours have one:
/// comparisons with it are false, so it is no good plane, no bad one and never the cheapest, and
/// what a pixel gets does not depend on the pixels it shares a register with.
constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

/// Candidate planes of a group and what each costs in each view.
struct Candidates {
  int count = 0;
  HWY_ALIGN float w[kPlanes][kLanes];
  HWY_ALIGN float a[kPlanes][kLanes];
  HWY_ALIGN float b[kPlanes][kLanes];
  HWY_ALIGN float cost[kPlanes][kMaxViews][kLanes];
};

/// Keeps, per lane, the pixel at (dx, dy) if it is cheaper than the cheapest so far.
HWY_INLINE void Cheaper(const State& state, int x, int y, int dx, int dy, VF* cost, VF* at_x,
                        VF* at_y) {
  const DF d;
  const VF c = LoadColour(state.cost, x + dx, y + dy);
  const auto less = hn::Lt(c, *cost);
  *cost = hn::IfThenElse(less, c, *cost);
  *at_x = hn::IfThenElse(less, hn::Set(d, static_cast<float>(dx)), *at_x);
  *at_y = hn::IfThenElse(less, hn::Set(d, static_cast<float>(dy)), *at_y);
}

/// Adds the plane of the cheapest pixel of a region, continued to the group's pixels.
/// `forward` points away from the pixel; a near region is a V, a far one a strip.
void AddRegion(const State& state, const Group& g, int fx, int fy, bool far_strip,
               Candidates* candidates) {
  const DF d;
  VF cost = hn::Set(d, std::numeric_limits<float>::infinity());
  VF at_x = hn::Zero(d), at_y = hn::Zero(d);
  if (far_strip) {
    for (int i = 0; i < kFarSamples; ++i) {
      const int reach = 3 + 2 * i;
      Cheaper(state, g.x, g.y, reach * fx, reach * fy, &cost, &at_x, &at_y);
    }
  } else {
    Cheaper(state, g.x, g.y, fx, fy, &cost, &at_x, &at_y);
    for (int i = 1; 2 * i < kNearSamples; ++i) {
      for (const int side : {-i, i}) {
        Cheaper(state, g.x, g.y, (i + 1) * fx + side * fy, (i + 1) * fy + side * fx, &cost, &at_x,
                &at_y);
      }
    }
  }
  const VF stride = hn::Set(d, static_cast<float>(state.w.stride()));
  const auto offset = hn::Add(EverySecond(), hn::ConvertTo(DI(), hn::MulAdd(at_y, stride, at_x)));
  const VF a = hn::GatherIndex(d, state.a.at(g.x, g.y), offset);
  const VF b = hn::GatherIndex(d, state.b.at(g.x, g.y), offset);
  VF w = hn::GatherIndex(d, state.w.at(g.x, g.y), offset);
  w = hn::NegMulAdd(a, at_x, hn::NegMulAdd(b, at_y, w));
  const int n = candidates->count++;
  hn::Store(w, d, candidates->w[n]);
  hn::Store(a, d, candidates->a[n]);
  hn::Store(b, d, candidates->b[n]);
}

/// Adds the plane that something suggests, to the lanes that have one.
void AddSuggested(const BorderedGrid& of_w, const BorderedGrid& of_a, const BorderedGrid& of_b,
                  const Group& g, Candidates* c) {
  const DF d;
  const VF w = LoadColour(of_w, g.x, g.y);
  const auto given = hn::Gt(w, hn::Zero(d));
  if (hn::AllFalse(d, given)) return;
  const int n = c->count++;
  hn::Store(hn::IfThenElse(given, w, hn::Set(d, kNothing)), d, c->w[n]);
  hn::Store(LoadColour(of_a, g.x, g.y), d, c->a[n]);
  hn::Store(LoadColour(of_b, g.x, g.y), d, c->b[n]);
}

void CollectCandidates(const Level& level, const State& state, const Group& g, int far_regions,
                       Candidates* c) {
  const DF d;
  c->count = 1;
  hn::Store(LoadColour(state.w, g.x, g.y), d, c->w[0]);
  hn::Store(LoadColour(state.a, g.x, g.y), d, c->a[0]);
  hn::Store(LoadColour(state.b, g.x, g.y), d, c->b[0]);
  constexpr int kDirections[4][2] = {{0, -1}, {0, 1}, {-1, 0}, {1, 0}};
  for (const auto& f : kDirections) AddRegion(state, g, f[0], f[1], false, c);
  for (int i = 0; i < far_regions; ++i) {
    AddRegion(state, g, kDirections[i][0], kDirections[i][1], true, c);
  }
  for (const State::Hypothesis& hypothesis : state.hypotheses) {
    AddSuggested(hypothesis.w, hypothesis.a, hypothesis.b, g, c);
  }
  if (const auto& expected = level.expected) {
    AddSuggested(expected->w, expected->a, expected->b, g, c);
  }
}

}  // namespace dtr::stereo::patchmatch::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
