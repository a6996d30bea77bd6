// cli/option_names.h -- messages of libraries in the words of the command line.
#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace dtr::cli {

/// Libraries know no options: their messages name the field of a struct, in back quotes
/// (`max_loss_db`: ...). Remembers what the options of `app` and of its commands are called.
void LearnOptionNames(const CLI::App& app);

/// A message with --max-loss-db in the place of `max_loss_db`, for every field that an option is
/// called after. Others stay as they are.
std::string WithOptionNames(const std::string& message);

/// WithOptionNames for a terminal: names in it cannot turn the direction of writing.
std::string ShownText(const std::string& message);

}  // namespace dtr::cli
