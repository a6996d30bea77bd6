// pipeline/core/view_names.h -- views as people name them.
#pragma once
#include <string>
#include <vector>

#include "dtr/types/dtr_set.h"

namespace dtr::pipeline {

/// The view of the first frame called `name`: its photo's name, with or without the extension, or
/// its id where no photo is called so. Throws UsageError naming a few that exist when there is
/// none, and naming two where nothing but an extension tells photos apart.
const View& FindView(const DtrSet& set, const std::string& name);

/// The names of the views that a comma-separated list means, each by FindView. Empty list: none.
std::vector<std::string> ResolveViewNames(const DtrSet& set, const std::string& list);

}  // namespace dtr::pipeline
