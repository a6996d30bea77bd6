// pipeline/build/advise.h -- what dtr/advise says of a set on disk.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "dtr/advise/advise.h"
#include "dtr/types/dtr_set.h"

namespace dtr::pipeline {

/// The source views of a set that have depth, coarse. `set` is of `folder`, without copies of
/// views.
std::vector<advise::CoarseView> CoarseViewsOf(const std::filesystem::path& folder,
                                              const DtrSet& set, double memory_gb,
                                              Progress& progress);

/// "3 of 40 positions ... are poor", and what is to be done about it: two lines for who reads on in
/// `dtr advise`. The same for any number of threads.
std::vector<std::string> AdviceLines(const advise::Advice& advice);

}  // namespace dtr::pipeline
