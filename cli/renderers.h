// cli/renderers.h -- the renderers by name, as --renderer knows them.
#pragma once
#include <CLI/CLI.hpp>
#include <string>

#include "dtr/eval/held_out.h"

namespace dtr::cli {

/// Adds --renderer to a command; `name` gets its value.
void AddRendererOption(CLI::App& command, std::string& name);

/// The default: "gl" in programs built with OpenGL, else "cpu".
std::string DefaultRenderer();

/// The renderer of that name, ready to draw: a context is opened here for "gl", on the thread that
/// must draw with it too. Throws dtr::Error, one line that names --renderer cpu, where the machine
/// has no OpenGL 4.3: nothing falls back silently.
eval::RenderFunction MakeRenderer(const std::string& name);

/// "gl"; only in programs built with OpenGL.
eval::RenderFunction MakeGlRenderer();

}  // namespace dtr::cli
