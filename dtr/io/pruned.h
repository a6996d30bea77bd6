// dtr/io/pruned.h -- what set.json says about what was left out of a set (docs/FORMAT.md, 2.1).
#pragma once
#include <string>

#include "dtr/types/dtr_set.h"

namespace dtr::io {

/// The object `pruned` of the set as JSON text; "" for a set that nothing was left out of. Throws
/// Error where it is no object.
std::string PrunedJson(const DtrSet& set);
/// Puts it there, in the place of one before; "" takes that out.
void SetPrunedJson(DtrSet& set, const std::string& json);

/// The rendering options that the set was pruned for, which are its defaults.
struct StoredRenderOptions {
  std::string json = "{}";  ///< as WithStoredOptions (dtr/render/stored_options.h) takes them
  std::string where;        ///< the field of set.json, for messages
};

/// `pruned.render`; `pruned.render_arguments` of sets of earlier builds; "{}" where there is
/// neither.
StoredRenderOptions RenderOptionsOf(const DtrSet& set);

/// For people: what was left out and why and what was taken back, a line each, and the losses that
/// were checked; "" for a set that nothing was left out of.
std::string DescribePruned(const DtrSet& set);

}  // namespace dtr::io
