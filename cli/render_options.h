// cli/render_options.h -- the options of `dtr render`, shared by every command that renders.
#pragma once
#include <CLI/CLI.hpp>
#include <memory>

#include "dtr/render/options.h"
#include "dtr/types/dtr_set.h"

namespace dtr::cli {

/// Declares the rendering options on `command`; the returned value holds them after parsing.
/// Angles are given in degrees and arrive in radians.
std::shared_ptr<RenderOptions> AddRenderOptions(CLI::App& command,
                                                const RenderOptions& defaults = {});

/// Gives `options`, the parsed ones of `command`, those that the set was pruned for and its user
/// did not give: they are the set's defaults. Throws Error for what is no option of rendering.
void UseStoredOptions(const CLI::App& command, const DtrSet& set, RenderOptions& options);

/// The set's own defaults: what it was pruned for, else the library's. Throws as above.
RenderOptions StoredRenderOptions(const DtrSet& set, const RenderOptions& defaults = {});

}  // namespace dtr::cli
