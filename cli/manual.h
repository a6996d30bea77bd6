// cli/manual.h -- what the commands say of themselves, as a man page and as shell completion: made
// from the parser, so that neither can fall behind it.
#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace dtr::cli {

/// The page dtr(1) in man(7)'s macros: every command and option of `app` with its description.
std::string ManualPage(const CLI::App& app, const std::string& version);

/// A script for bash: completes commands, their options, the values of options that have a closed
/// list of them, and file names everywhere else.
std::string BashCompletion(const CLI::App& app);

}  // namespace dtr::cli
