// cli/option_text.h -- the words of an option, as help, man page and completion show them.
#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace dtr::cli {

/// "-o", "--output": its names with their dashes.
std::vector<std::string> NamesOf(const CLI::Option& option);

/// The type as it was declared. CLI11 appends what a value is checked for ("N:INT in [0 - 9]"), and
/// a type of ours may have a colon of its own ("every:N|NAME,...").
std::string TypeOf(const CLI::Option& option);

/// The words that a value may be, such as "mesh" and "splat"; empty where any may be given.
std::vector<std::string> ChoicesOf(const CLI::Option& option);

/// "0 to 9" where a number is checked for a range that is worth a word, else "".
std::string RangeOf(const CLI::Option& option);

/// Visible options in the order in which they were added, without positionals.
std::vector<const CLI::Option*> OwnOptionsOf(const CLI::App& command);

/// Its groups of options of which one is to be given: CLI11 has them as commands without a name.
std::vector<const CLI::App*> AlternativesOf(const CLI::App& command);

/// Its own options, then those of its alternatives.
std::vector<const CLI::Option*> OptionsOf(const CLI::App& command);

}  // namespace dtr::cli
