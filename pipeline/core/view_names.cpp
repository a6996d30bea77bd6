#include "pipeline/core/view_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "dtr/base/error.h"
#include "dtr/types/photo_names.h"

namespace dtr::pipeline {

const View& FindView(const DtrSet& set, const std::string& name) {
  const std::vector<View>& views = set.frames.front().views;
  std::vector<std::string> names;
  for (const View& view : views) names.push_back(view.name);
  const std::vector<size_t> called = PhotosCalled(names, name);
  if (called.size() > 1) {
    throw UsageError(fmt::format("'{}' may be {} or {}; name the photo with its extension", name,
                                 names[called[0]], names[called[1]]));
  }
  if (!called.empty()) return views[called.front()];
  const auto found =
      std::find_if(views.begin(), views.end(), [&](const View& view) { return view.id == name; });
  if (found != views.end()) return *found;
  constexpr size_t kExamples = 3;
  std::string examples;
  for (size_t i = 0; i < std::min(kExamples, views.size()); ++i) {
    examples += (i == 0 ? "" : ", ") + views[i].name;
  }
  throw UsageError(fmt::format("no view is named '{}'; the set has {} ... ({} views, see dtr info)",
                               name, examples, views.size()));
}

std::vector<std::string> ResolveViewNames(const DtrSet& set, const std::string& list) {
  std::vector<std::string> names;
  std::istringstream parts(list);
  for (std::string part; std::getline(parts, part, ',');) {
    names.push_back(FindView(set, part).name);
  }
  return names;
}

}  // namespace dtr::pipeline
