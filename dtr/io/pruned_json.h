// dtr/io/pruned_json.h -- internal to this project: the object `pruned` of a set, as JSON.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "dtr/types/dtr_set.h"

namespace dtr::io {

/// null for a set that nothing was left out of. Throws Error where it is no object.
nlohmann::ordered_json PrunedOf(const DtrSet& set);
/// Puts it there, in the place of one before.
void SetPruned(DtrSet& set, const nlohmann::ordered_json& pruned);

}  // namespace dtr::io
