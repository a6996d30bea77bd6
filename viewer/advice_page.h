// viewer/advice_page.h -- advice on a capture, to look at.
#pragma once
#include <string>

#include "dtr/advise/advise.h"
#include "dtr/types/dtr_set.h"

namespace dtr::viewer {

/// One offline page: the cameras from above with those to add and those that add nothing, and a
/// table of all places that were looked from, the poor ones first. `set` needs no pixels.
std::string AdvicePage(const std::string& name, const DtrSet& set, const advise::Advice& advice,
                       const advise::AdviseOptions& options);

}  // namespace dtr::viewer
