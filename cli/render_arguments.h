// cli/render_arguments.h -- RenderOptions as the words of a command line.
#pragma once
#include <string>
#include <vector>

#include "dtr/render/options.h"

namespace dtr::cli {

/// The arguments that give `options` where `base` holds without them, none for what they share:
/// the words of `dtr render` for a set whose own options are `base`. Parsing them gives every
/// option bit by bit (angles: those that come of degrees), but for the number of threads.
std::vector<std::string> RenderOptionArguments(const RenderOptions& options,
                                               const RenderOptions& base = {});

}  // namespace dtr::cli
