#include "calib/colmap/program.h"

#include <fmt/format.h>
#include <signal.h>

#include <sstream>

#include "calib/colmap/model_io.h"
#include "calib/sfm/run/sfm_steps.h"
#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/process.h"

namespace dtr::colmap {
namespace {

constexpr char kProgram[] = "colmap";
constexpr size_t kLongestCause = 200;  // of a message; the log has the rest

std::vector<std::string> LinesOf(const std::vector<std::string>& argv) {
  std::vector<std::string> lines;
  ProcessOptions options;
  options.on_line = [&](const std::string& line) { lines.push_back(line); };
  const ProcessResult result = RunProcess(argv, options);
  if (!result.Ok()) {
    throw Error(fmt::format("{}: '{} {}' failed ({} {}); reinstall COLMAP",
                            FindProgram(kProgram).string(), argv[0], argv[1],
                            result.signal != 0 ? "signal" : "exit code",
                            result.signal != 0 ? result.signal : result.exit_code));
  }
  return lines;
}

bool LooksLikeAnError(const std::string& line) {
  // glog's fatal lines start with F and a date; stack traces follow them.
  if (line.size() > 1 && line[0] == 'F' && line[1] >= '0' && line[1] <= '9') return true;
  for (const char* mark :
       {"ERROR", "Error", "Check failed", "what():", "terminate", "unrecognised option"}) {
    if (line.find(mark) != std::string::npos) return true;
  }
  return false;
}

// Keeps the line that most likely says why a program failed.
class CauseFinder {
 public:
  void Feed(const std::string& line) {
    const size_t first = line.find_first_not_of(" \t=-*");
    if (first == std::string::npos) return;
    last_ = line.substr(first, kLongestCause);
    if (unwritten_.empty() && last_.starts_with("SQLite error")) unwritten_ = last_;
    if (error_.empty() && LooksLikeAnError(line)) error_ = last_;
  }
  /// What the database did not take, or nothing. COLMAP 3.8 says so, goes on and ends with 0.
  const std::string& Unwritten() const { return unwritten_; }
  std::string Cause() const {
    if (!unwritten_.empty()) return unwritten_;
    if (!error_.empty()) return error_;
    return last_.empty() ? "it printed nothing" : "last line: " + last_;
  }

 private:
  std::string error_, last_, unwritten_;
};

std::string HowItEnded(const ProcessResult& result) {
  if (result.signal == SIGKILL) {
    return "it was killed, most likely because memory ran out; lower the memory limit or the "
           "image size";
  }
  if (result.signal != 0) return fmt::format("it crashed with signal {}", result.signal);
  return fmt::format("expected exit code 0, found {}", result.exit_code);
}

}  // namespace

bool Program::IsInstalled() { return !FindProgram(kProgram).empty(); }

sfm::ColmapState Program::Find() {
  if (!IsInstalled()) return {};
  try {
    return {Program().version(), ""};
  } catch (const Error& error) {
    return {"", error.what()};
  }
}

Program::Program() {
  if (!IsInstalled()) {
    throw Error(
        "colmap: program not found on the PATH; install it (apt-get install colmap), or leave out "
        "--sfm colmap and --engine colmap");
  }
  for (const std::string& line : LinesOf({kProgram, "help"})) {
    // "(Commit ... on ... with CUDA)", or without.
    if (line.find("with CUDA") != std::string::npos) has_cuda_ = true;
    if (!version_.empty() || line.find("COLMAP") == std::string::npos) continue;
    version_ = line.substr(line.find("COLMAP"));
  }
  if (version_.empty()) {
    throw Error(FindProgram(kProgram).string() +
                ": expected a program that calls itself COLMAP, found one that does not");
  }
}

const char* Program::FindOption(const std::string& command,
                                std::initializer_list<const char*> names) {
  if (!options_.contains(command)) {
    auto& known = options_[command];
    for (const std::string& line : LinesOf({kProgram, command, "-h"})) {
      std::istringstream words(line);
      for (std::string word; words >> word;) {
        if (word.starts_with("--")) known.insert(word.substr(2));
      }
    }
  }
  for (const char* name : names) {
    if (options_[command].contains(name)) return name;
  }
  return nullptr;
}

Arguments::Arguments(const std::string& command) : command_(command), argv_{kProgram, command} {}

Arguments& Arguments::Add(std::initializer_list<const char*> names, const std::string& value) {
  const char* name = program_.FindOption(command_, names);
  if (name == nullptr) {
    throw Error(
        fmt::format("colmap {}: expected the option --{}, found a version ({}) without it; "
                    "install another version (tested with 3.8 and 3.10)",
                    command_, *names.begin(), program_.version()));
  }
  argv_.push_back(std::string("--") + name);
  argv_.push_back(value);
  return *this;
}

Arguments& Arguments::AddIfKnown(std::initializer_list<const char*> names,
                                 const std::string& value) {
  return program_.FindOption(command_, names) == nullptr ? *this : Add(names, value);
}

void AllowForwardMotion(Arguments& arguments) {
  arguments.AddIfKnown({"Mapper.init_max_forward_motion"}, "1")
      .AddIfKnown({"Mapper.init_min_tri_angle"}, "2")
      .AddIfKnown({"Mapper.filter_min_tri_angle"}, "0.5")
      .AddIfKnown({"Mapper.abs_pose_min_num_inliers"}, std::to_string(sfm::kMinInliersForward));
}

void RunColmap(const std::vector<std::string>& argv, sfm::StepRecord& record,
               const std::function<void(const std::string&)>& on_line, Progress& progress) {
  progress.ThrowIfInterrupted();
  record.argv = argv;
  TryRemoveFile(record.log_file);  // RunProcess appends
  CauseFinder cause;
  ProcessOptions options;
  options.log_file = record.log_file;
  options.should_stop = [&] { return progress.StopRequested(); };
  options.on_line = [&](const std::string& line) {
    cause.Feed(line);
    if (on_line) on_line(line);
  };
  const ProcessResult result = RunProcess(argv, options);
  record.exit_code = result.exit_code;
  record.signal = result.signal;
  record.wall_s = result.wall_s;
  record.cpu_s = result.cpu_s;
  record.max_rss_kib = result.max_rss_kib;
  progress.ThrowIfInterrupted();
  if (result.Ok() && cause.Unwritten().empty()) return;
  const std::string ended =
      result.Ok() ? "expected all of its results in its database" : HowItEnded(result);
  throw Error(fmt::format("colmap {} ({}): {}: {}; see {}", argv.at(1), record.name, ended,
                          cause.Cause(), record.log_file.string()));
}

void RunStep(sfm::Workspace& workspace, const Arguments& arguments,
             const std::function<void(const std::string&)>& on_line) {
  workspace.RunProgram([&](sfm::StepRecord& record) {
    RunColmap(arguments.argv(), record, on_line, workspace.progress());
  });
}

calib::SfmModel ReadModelHere(const sfm::Workspace& workspace,
                              const std::filesystem::path& folder) {
  calib::SfmModel model = ReadModel(folder);
  for (calib::SfmImage& image : model.images) image.name = workspace.NameOfAlias(image.name);
  return model;  // aliases sort as the names do
}

}  // namespace dtr::colmap
