// dtr/render/option_arguments.h -- RenderOptions as the words of a command line, and back.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "dtr/render/options.h"

namespace dtr {

/// The arguments that give `options` where `base` holds without them, none for what they share:
/// the words of `dtr render` for a set whose own options are `base`. Parsing them gives every
/// option bit by bit (angles: those that come of degrees), but for the number of threads.
std::vector<std::string> RenderOptionArguments(const RenderOptions& options,
                                               const RenderOptions& base = {});

/// The other way round: `base` with what such arguments say, but for those whose flag `skip` says
/// yes to. Nothing else is understood: they may come from a set, which must not set what files a
/// program writes. Throws dtr::Error, beginning with `where`, for all others and for values without
/// meaning.
RenderOptions WithArguments(
    const RenderOptions& base, const std::vector<std::string>& arguments, const std::string& where,
    const std::function<bool(const std::string& flag)>& skip = [](const std::string&) {
      return false;
    });

}  // namespace dtr
