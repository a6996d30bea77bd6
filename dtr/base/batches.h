// dtr/base/batches.h -- what comes one by one and is finished several at a time.
#pragma once
#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "dtr/base/parallel_for.h"

namespace dtr {

/// Keeps items until as many are there as the caller has threads, or as `most_bytes` hold, and then
/// works on all of them at once (ParallelFor): images are encoded and compared on all cores between
/// frames that were drawn on all cores, so that the time of a frame is the frame's own.
template <typename Item>
class Batches {
 public:
  Batches(double bytes_of_item, double most_bytes, std::function<void(Item&)> work)
      : at_once_(static_cast<size_t>(
            std::clamp(most_bytes / bytes_of_item, 1.0, 1.0 * ThreadLimit::Current()))),
        work_(std::move(work)) {}

  void Add(Item item) {
    items_.push_back(std::move(item));
    if (items_.size() >= at_once_) Finish();
  }
  /// Works on what is left. What was added and not finished is dropped with the object.
  void Finish() {
    ParallelFor(0, static_cast<int>(items_.size()),
                [this](int i) { work_(items_[static_cast<size_t>(i)]); });
    items_.clear();
  }

 private:
  const size_t at_once_;
  const std::function<void(Item&)> work_;
  std::vector<Item> items_;
};

}  // namespace dtr
