// cli/help.h -- `--help` on one screen, `--help-all` in groups.
#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace dtr::cli {

/// Lays out the help of a command on lines of at most 100 columns. Where not all options fit on a
/// screen of 40 lines, `--help` has those that most runs need and names the groups of the others,
/// which `--help-all` shows.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* command, std::string name,
                        CLI::AppFormatMode mode) const override;
};

}  // namespace dtr::cli
