// dtr/types/distinct_views.h -- views that count once, however often a set has them.
#pragma once
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "dtr/types/view.h"

namespace dtr {

/// Indices, ascending, of the views that repeat none before them. Views repeat each other only
/// where their poses and what `content` gives are equal, so `repeats` is called for these alone and
/// the time grows with the number of views, not with that of their pairs.
std::vector<size_t> DistinctViews(std::span<const View* const> views,
                                  const std::function<std::string(const View&)>& content,
                                  const std::function<bool(const View&, const View&)>& repeats);

}  // namespace dtr
