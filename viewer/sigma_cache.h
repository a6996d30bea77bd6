// viewer/sigma_cache.h -- sigmas of the views that an image is drawn from, read when they are
// asked for.
#pragma once
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "dtr/types/view.h"

namespace dtr::viewer {

/// Keeps what it read until an image of other views needs the room: sigmas are as large as depth,
/// and --memory knows nothing of them.
class SigmaCache {
 public:
  using Load = std::function<Grid<float>(const View&)>;
  explicit SigmaCache(Load load) : load_(std::move(load)) {}

  /// Null where it must be read first: the look-up for every pixel.
  const Grid<float>* Known(const View& view) const {
    const auto known = kept_.find(&view);
    return known != kept_.end() ? &known->second : nullptr;
  }
  /// `in_picture`: the views that may be asked for before the image changes; all others'
  /// sigmas go when one is read. The pointer holds until then.
  const Grid<float>* Of(const View& view, const std::set<const View*>& in_picture) {
    if (const Grid<float>* known = Known(view)) return known;
    std::erase_if(kept_, [&](const auto& one) { return !in_picture.contains(one.first); });
    return &(kept_[&view] = load_(view));
  }
  size_t size() const { return kept_.size(); }

 private:
  const Load load_;
  std::map<const View*, Grid<float>> kept_;
};

}  // namespace dtr::viewer
