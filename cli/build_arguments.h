// cli/build_arguments.h -- the options of `dtr build`, which `dtr batch` takes too.
#pragma once
#include <optional>
#include <string>

#include "cli/command.h"
#include "cli/metre_options.h"
#include "pipeline/build/build.h"
#include "pipeline/build/build_part.h"
#include "pipeline/dynamic/build_dynamic.h"

namespace dtr::cli {

struct BuildArguments {
  pipeline::BuildOptions options;
  bool is_dynamic = false;
  std::string temporal = "on", clocks = "synchronised", video;
  std::string stage, part = "1/1";
  pipeline::DynamicOptions dynamic;
  MetreWords metre_words;
};

/// Declares them; `arguments` must outlive the command.
void AddBuildOptions(CLI::App& command, BuildArguments& arguments);

/// When the command line was read: brings what the words mean into arguments.options and .dynamic.
/// Throws UsageError.
void FinishBuildArguments(const CommonOptions& common, BuildArguments& arguments);

/// The one part that is asked for. Throws UsageError for words that cannot be meant.
std::optional<pipeline::BuildPart> PartOf(const BuildArguments& arguments);

}  // namespace dtr::cli
