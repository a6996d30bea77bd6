// cli/render_options.h -- the options of `dtr render`, shared by every command that renders.
#pragma once
#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "dtr/render/options.h"

namespace dtr::cli {

/// Declares the rendering options on `command`; the returned value holds them after parsing.
/// Angles are given in degrees and arrive in radians.
std::shared_ptr<RenderOptions> AddRenderOptions(CLI::App& command);

/// The other way round: the arguments that give these options, without those that are the default.
/// Parsing them gives every option bit by bit (angles: those that come of degrees), but for the
/// number of threads.
std::vector<std::string> RenderOptionArguments(const RenderOptions& options);

/// Gives `command`, after parsing, those of the arguments (as RenderOptionArguments makes them) that
/// its user did not give: what a set was pruned for is its default. Options that the command lacks
/// are passed over. Throws Error for a value that an option refuses.
void UseStoredArguments(CLI::App& command, const std::vector<std::string>& arguments);

}  // namespace dtr::cli
