// cli/suggestions.h -- what somebody meant who mistyped a command or an option.
#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace dtr::cli {

/// The candidate that `typed` was meant for: one that begins with it, or that differs from it by
/// few letters (left out, put in, exchanged, swapped: Damerau's distance), the nearest. Empty where
/// none is near, or two are equally near.
std::string Nearest(const std::string& typed, const std::vector<std::string>& candidates);

/// " (did you mean 'build'?)", empty where Nearest is.
std::string DidYouMean(const std::string& typed, const std::vector<std::string>& candidates);

/// The names of an app's visible commands.
std::vector<std::string> CommandNames(const CLI::App& app);

/// `words`, those behind the program's name, with "help COMMAND..." as "COMMAND... --help".
std::vector<std::string> WithHelpAsOption(std::vector<std::string> words);

/// The line of `words` that call no command of the `candidates`, the last word: the one that may be
/// meant, or that the program was built without it.
std::string NoCommandCalled(const std::vector<std::string>& words,
                            const std::vector<std::string>& candidates);

/// That the program was built without a command, or an option of it ("build --dynamic"); empty
/// where it was not.
std::string BuiltWithout(const std::string& command);

/// The line for the first of these words that calls a command that does not exist, below one that
/// has commands; empty where all exist.
std::string UnknownCommand(const CLI::App& app, const std::vector<std::string>& words);

/// " (--holdot: did you mean --holdout?)" for the first option among the words that the command
/// that they call does not have; empty where it has all, or none is near.
std::string MeantOption(const CLI::App& app, const std::vector<std::string>& words);

}  // namespace dtr::cli
