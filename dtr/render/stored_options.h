// dtr/render/stored_options.h -- RenderOptions as JSON, as set.json keeps them
// (docs/FORMAT.md, 2.1).
#pragma once
#include <functional>
#include <string>

#include "dtr/render/options.h"

namespace dtr {

/// What differs from `base`, as an object by the fields' names; the angle in degrees
/// (max_angle_deg), choices by their names. WithStoredOptions gives every field back bit by bit
/// (angles: those that come of degrees), but for the number of threads.
std::string ToJson(const RenderOptions& options, const RenderOptions& base = {});

/// `base` with the fields of such an object, but for those whose name `skip` says yes to. Sets of
/// version 0.1 hold a list of words of a command line instead (["--views", "4"]): it is understood
/// as well. Throws dtr::Error, beginning with `where`, for anything else, a field that
/// RenderOptions does not have and a value without meaning.
RenderOptions WithStoredOptions(
    const RenderOptions& base, const std::string& json, const std::string& where,
    const std::function<bool(const std::string& field)>& skip = [](const std::string&) {
      return false;
    });

}  // namespace dtr
