#include "cli/program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <exception>
#include <filesystem>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/help.h"
#include "cli/option_names.h"
#include "cli/standard_output.h"
#include "cli/suggestions.h"
#include "dtr/base/error.h"

namespace dtr::cli {
namespace {

int Run(int argc, char** argv) {
  CLI::App app("dtr -- Depth + Texture Representation: photos in, novel views out", "dtr");
  app.set_version_flag("--version", DTR_VERSION);
  app.require_subcommand(1);
  app.formatter(std::make_shared<HelpFormatter>());
  app.set_help_all_flag("--help-all", "Print all options");
  AddCallableCommands(app);
  if constexpr (DTR_WITH_BATCH) AddBatchCommand(app);
#ifdef DTR_WITH_WINDOWS
  AddViewCommand(app);
#endif
  if constexpr (DTR_WITH_BENCH) AddBenchCommand(app);
  AddSelftestCommand(app);
  AddManualCommands(app, DTR_VERSION);
  LearnOptionNames(app);
  std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  RequirePlainArguments(words);
  words = WithHelpAsOption(std::move(words));
  // CLI11 would say that a command is missing, not that this one does not exist.
  if (const std::string unknown = UnknownCommand(app, words); !unknown.empty()) {
    WriteErr(fmt::format("dtr: {}; see dtr --help\n", unknown));
    return kWrongUsage;
  }
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));  // as CLI11 wants them
    return kDone;
  } catch (const CLI::RuntimeError& ended) {
    return ended.get_exit_code();
  } catch (const CLI::Success& help_or_version) {
    std::ostringstream text;
    const int code = app.exit(help_or_version, text, text);
    WriteOut(text.str());
    return code;
  } catch (const CLI::ParseError& error) {
    WriteErr(fmt::format("dtr: {}{}; see dtr --help\n", error.what(), MeantOption(app, words)));
    return kWrongUsage;
  }
}

/// Every image and every view takes tens of megabytes and frees them for the next to take again.
/// glibc would hand them back in between, and the system clear them again page by page: a tenth of
/// the time of an image with holes. What is kept is bounded, and in two arenas for all threads: one
/// for each would keep what any thread ever needed (plaza with --memory 1 and 16 threads: 1.35 GB).
void KeepFreedMemory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 128 << 20);
  mallopt(M_ARENA_MAX, 2);
#endif
}

/// A standard descriptor that the caller closed would be that of the next file that is opened, and
/// messages would go into it. What is written to a closed standard output still fails.
void OccupyStandardDescriptors() {
  constexpr int kFlags[] = {O_RDONLY, O_RDONLY, O_WRONLY};
  for (int fd = STDIN_FILENO; fd <= STDERR_FILENO; ++fd) {
    if (fcntl(fd, F_GETFD) >= 0) continue;
    if (open("/dev/null", kFlags[fd]) < 0) return;  // takes the lowest number that is free
  }
}

}  // namespace

int RunProgram(int argc, char** argv) {
  OccupyStandardDescriptors();
  KeepFreedMemory();
  CatchInterrupts();
  try {
    return Run(argc, argv);
  } catch (const UsageError& error) {
    WriteErr(fmt::format("dtr: {}\n", ShownText(error.what())));
    return kWrongUsage;
  } catch (const Error& error) {
    WriteErr(fmt::format("dtr: {}\n", ShownText(error.what())));
    return kFailed;
  } catch (const std::filesystem::filesystem_error& error) {
    WriteErr(fmt::format(
        "dtr: {}: expected a folder or file that can be used, found: {}; fix it or choose "
        "another\n",
        error.path1().string(), error.code().message()));
    return kFailed;
  } catch (const std::bad_alloc&) {
    WriteErr(
        "dtr: memory: expected enough for this job, found too little; close other programs, "
        "or lower --max-size, --size or --memory\n");
    return kFailed;
  } catch (const std::exception& error) {
    WriteErr(fmt::format(
        "dtr: expected no fault of its own, found: {}; report this line and the command\n",
        error.what()));
    return kFailed;
  }
}

}  // namespace dtr::cli
