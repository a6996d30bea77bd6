#include "dtr/render/semi_global.h"

#include <algorithm>
#include <limits>

#include "dtr/base/parallel_for.h"

// Part of this file is compiled once per instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "dtr/render/semi_global.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef DTR_RENDER_SEMI_GLOBAL_PATH_
#define DTR_RENDER_SEMI_GLOBAL_PATH_
namespace dtr {

/// Slots are filled up to multiples of this.
inline constexpr size_t kSlotsTogether = 16;
inline constexpr float kNever = std::numeric_limits<float>::infinity();

/// One path of cells.
struct LabelPath {
  const float* costs;   ///< of the first cell
  float* sums;          ///< likewise
  std::ptrdiff_t step;  ///< from cell to cell, in floats
  int cells;
  size_t step_slots, slots;
  float next, any;
};

}  // namespace dtr
#endif

HWY_BEFORE_NAMESPACE();
namespace dtr::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, kSlotsTogether>;

void FollowImpl(const LabelPath& path) {
  const DF d;
  const size_t lanes = hn::Lanes(d);
  const auto next = hn::Set(d, path.next), never = hn::Set(d, kNever);
  // One more on either side: what lies beyond the first and the last step.
  std::vector<float> buffers[2];
  for (auto& buffer : buffers) {
    buffer.assign(path.slots + 2, 0);
    buffer.front() = buffer.back() = kNever;
  }
  const float* costs = path.costs;
  float *sums = path.sums, *before = buffers[0].data() + 1, *now = buffers[1].data() + 1;
  float min_before = 0;
  for (int cell = 0; cell < path.cells; ++cell, costs += path.step, sums += path.step) {
    const auto least = hn::Set(d, min_before), any = hn::Set(d, min_before + path.any);
    auto smallest = never;
    for (size_t s = 0; s < path.slots; s += lanes) {
      auto cheapest = hn::Min(hn::LoadU(d, before + s), any);
      if (s < path.step_slots) {
        const auto lower = hn::LoadU(d, before + s - 1), upper = hn::LoadU(d, before + s + 1);
        cheapest = hn::Min(cheapest, hn::Add(hn::Min(lower, upper), next));
      }
      const auto cost = hn::Sub(hn::Add(hn::LoadU(d, costs + s), cheapest), least);
      hn::StoreU(cost, d, now + s);
      hn::StoreU(hn::Add(hn::LoadU(d, sums + s), cost), d, sums + s);
      smallest = hn::Min(smallest, cost);
    }
    min_before = hn::GetLane(hn::MinOfLanes(d, smallest));
    std::swap(before, now);
  }
}

}  // namespace dtr::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace dtr {
namespace {

HWY_EXPORT(FollowImpl);

void Follow(const LabelPath& path) { HWY_DYNAMIC_DISPATCH(FollowImpl)(path); }

size_t WholeVectors(size_t slots) {
  return (slots + kSlotsTogether - 1) / kSlotsTogether * kSlotsTogether;
}

}  // namespace

SemiGlobal::SemiGlobal(int columns, int rows, size_t labels, const LabelChanges& changes,
                       int threads)
    : columns_(columns),
      rows_(rows),
      changes_(changes),
      // One more: the last step has no other label beside it.
      step_slots_(changes.steps > 0 ? WholeVectors(changes.steps + 1) : 0),
      slots_(step_slots_ + WholeVectors(labels - changes.steps)),
      threads_(threads),
      costs_(std::make_unique_for_overwrite<float[]>(At(0, rows))),
      sums_(std::make_unique_for_overwrite<float[]>(At(0, rows))) {
  // Megabytes that the system hands out page by page: by all threads.
  ParallelFor(0, rows, threads, [&](int y) {
    const size_t row = At(0, 1);
    std::fill_n(&costs_[At(0, y)], row, kNever);
    std::fill_n(&sums_[At(0, y)], row, 0.0f);
  });
}

void SemiGlobal::Solve() {
  const auto along = static_cast<std::ptrdiff_t>(slots_), down = along * columns_;
  const auto both_ways = [&](int x, int y, std::ptrdiff_t step, int cells) {
    LabelPath path{&costs_[At(x, y)], &sums_[At(x, y)], step,          cells,
                   step_slots_,       slots_,           changes_.next, changes_.any};
    Follow(path);
    path.costs += step * (cells - 1), path.sums += step * (cells - 1), path.step = -step;
    Follow(path);
  };
  ParallelFor(0, rows_, threads_, [&](int y) { both_ways(0, y, along, columns_); });
  ParallelFor(0, columns_, threads_, [&](int x) { both_ways(x, 0, down, rows_); });
}

size_t SemiGlobal::Best(int x, int y) const {
  const float* sums = &sums_[At(x, y)];
  const auto slot = static_cast<size_t>(std::min_element(sums, sums + slots_) - sums);
  return slot < step_slots_ ? slot : slot - step_slots_ + changes_.steps;
}

}  // namespace dtr
#endif
