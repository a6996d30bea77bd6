// cli/render_options.h -- the options of `dtr render`, shared by every command that renders.
#pragma once
#include <CLI/CLI.hpp>
#include <memory>

#include "dtr/render/options.h"

namespace dtr::cli {

/// Declares the rendering options on `command`; the returned value holds them after parsing.
/// Angles are given in degrees and arrive in radians.
std::shared_ptr<RenderOptions> AddRenderOptions(CLI::App& command);

}  // namespace dtr::cli
