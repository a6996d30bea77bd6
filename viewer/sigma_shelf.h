// viewer/sigma_shelf.h -- sigmas of the views that a picture is drawn from, read when they are
// asked for.
#pragma once
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "dtr/types/view.h"

namespace dtr::viewer {

/// Keeps what it read until a picture of other views needs the room: sigmas are as large as depth,
/// and --memory knows nothing of them.
class SigmaShelf {
 public:
  using Load = std::function<Grid<float>(const View&)>;
  explicit SigmaShelf(Load load) : load_(std::move(load)) {}

  /// `in_picture`: the views that may be asked for before the picture changes; all others'
  /// sigmas go when one is read. The pointer holds until then.
  const Grid<float>* Of(const View& view, const std::set<const View*>& in_picture) {
    const auto known = kept_.find(&view);
    if (known != kept_.end()) return &known->second;
    std::erase_if(kept_, [&](const auto& one) { return !in_picture.contains(one.first); });
    return &(kept_[&view] = load_(view));
  }
  size_t size() const { return kept_.size(); }

 private:
  const Load load_;
  std::map<const View*, Grid<float>> kept_;
};

}  // namespace dtr::viewer
