// pipeline/core/reports/set_page.h -- report/index.html of a set.
#pragma once
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/io/set_io.h"
#include "dtr/types/check.h"
#include "dtr/types/dtr_set.h"
#include "pipeline/core/depth_prior.h"

namespace dtr::pipeline {

/// What the page says beyond the set itself.
struct SetPageFacts {
  std::string name;  ///< of the set, without extension
  std::string engine;
  std::vector<Check> checks;
  std::vector<std::pair<std::string, std::string>> skipped;  ///< file, reason
  size_t not_registered = 0;
  std::optional<DepthPriorReport> prior = {};
  double memory_gb = 0;  ///< GB of 1e9 bytes for all that the program holds; 0: no bound
};

/// Writes report/index.html into the writer's folder: source views only, as pixels of held-out
/// photos stay in held_out/, and without times, so that equal builds stay equal. Pixels are read
/// from there, of as many views at a time as the room allows.
void WriteSetPage(const io::SetWriter& writer, const DtrSet& set, const SetPageFacts& facts,
                  Progress& progress);

}  // namespace dtr::pipeline
