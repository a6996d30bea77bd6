// cli/command.h -- what every command of `dtr` has in common.
#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "cli/console.h"
#include "dtr/base/progress.h"

namespace dtr::cli {

/// Options that every command takes.
struct CommonOptions {
  std::string json_target;           ///< "" none, "-" standard output, else a file
  std::string* json_text = nullptr;  ///< of a command that another program calls: gets the JSON
  int threads = 0;                   ///< 0: all cores
  std::uint64_t seed = 0;
  bool force = false;  ///< --force of commands that have no such option of their own
};

/// What a command's action is given.
struct Context {
  const CommonOptions& common;
  Console& console;
  /// Writes the machine-readable result where --json asked for it; nothing without --json.
  void EmitJson(const std::string& json_text) const;
  /// Prints it, with `indent` spaces a level (-1: on one line). Names come from files: bytes that
  /// are no UTF-8 are replaced, so that they do not make the whole result unreadable.
  void EmitJson(const nlohmann::ordered_json& json, int indent = 1) const;
};

/// Exit codes of the command line.
enum ExitCode { kDone = 0, kFailed = 1, kWrongUsage = 2, kUndecided = 3 };

/// The commands of another program than `dtr` (run_command.h).
class CalledApp : public CLI::App {
 public:
  /// Both must outlive it.
  CalledApp(Progress& caller, std::string& json) : caller_(caller), json_(json) {}
  Progress& caller() const { return caller_; }
  std::string& json() const { return json_; }

 private:
  Progress& caller_;
  std::string& json_;
};

/// Adds a sub-command. `prepare` declares its options on the CLI::App and returns the action; the
/// action runs after parsing and returns the exit code.
using Action = std::function<int(const Context&)>;
void AddCommand(CLI::App& app, const std::string& name, const std::string& description,
                const std::string& example, const std::function<Action(CLI::App&)>& prepare);

/// --lens FILE of the commands that take a known lens.
CLI::Option* AddLensOption(CLI::App& command, std::filesystem::path& lens);

/// --memory GB of the commands that hold as many images at a time as fit into it; 4 without it.
void AddMemoryOption(CLI::App& command, double& memory_gb, const std::string& description);

// One function per command, each in commands/NAME.cpp.
void AddBuildCommand(CLI::App& app);
void AddBatchCommand(CLI::App& app);
void AddCaptureCommand(CLI::App& app);
void AddCalibrateCommand(CLI::App& app);
void AddCalibrateBoardCommand(CLI::App& calibrate);
void AddCalibrateRefineCommand(CLI::App& calibrate);  ///< below `calibrate`
void AddCalibrateRigCommand(CLI::App& calibrate);
void AddValidateCommand(CLI::App& app);
void AddStereoCommand(CLI::App& app);
void AddInfoCommand(CLI::App& app);
void AddRenderCommand(CLI::App& app);
void AddEvaluateCommand(CLI::App& app);
void AddBenchCommand(CLI::App& app);
void AddViewCommand(CLI::App& app);  ///< in programs built with windows
void AddInspectCommand(CLI::App& app);
void AddAdviseCommand(CLI::App& app);
void AddPruneCommand(CLI::App& app);
void AddImportCommand(CLI::App& app);
void AddExportCommand(CLI::App& app);
void AddDatasetCommand(CLI::App& app);
void AddJoinCommand(CLI::App& app);
void AddSelftestCommand(CLI::App& app);
void AddManualCommands(CLI::App& app, const std::string& version);  ///< of the whole of `app`

/// All of these but those of windows, of measurements of the program itself, and about the program.
void AddCallableCommands(CLI::App& app);

}  // namespace dtr::cli
