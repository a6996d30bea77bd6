#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "cli/build_arguments.h"
#include "cli/command.h"
#include "dtr/base/error.h"
#include "dtr/base/process.h"
#include "pipeline/batch/batch.h"

namespace dtr::cli {
namespace {

namespace fs = std::filesystem;

struct BatchArguments {
  pipeline::BatchOptions options;
  bool slurm = false;
};

// What every job is asked for, when they are begun and when they are begun again.
void AddRunOptions(CLI::App& command, BatchArguments& arguments) {
  pipeline::BatchOptions& options = arguments.options;
  CLI::Option* local =
      command.add_option("--local", options.local,
                         "Run the jobs here, so many processes at a time; each takes --memory");
  local->check(CLI::Range(1, 1024))->type_name("N");
  CLI::Option* slurm =
      command.add_flag("--slurm", arguments.slurm, "Submit the jobs to Slurm and return");
  slurm->excludes(local);
  command.add_option("--partition", options.slurm.partition, "With --slurm: partition of all jobs")
      ->needs(slurm);
  command.add_option("--account", options.slurm.account, "With --slurm: account of all jobs")
      ->needs(slurm);
  command
      .add_option("--time", options.slurm.time,
                  "With --slurm: time limit of each job, as sbatch takes it (2:00:00)")
      ->needs(slurm)
      ->type_name("TIME");
  command
      .add_option("--cpus-per-task", options.slurm.cpus_per_task,
                  "With --slurm: processors, and so --threads, of each process [the cluster's "
                  "default]")
      ->needs(slurm)
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  command.add_flag("--dry-run", options.dry_run, "Say what would be done and do nothing");
}

void RequireWhere(const BatchArguments& arguments) {
  if (arguments.slurm || arguments.options.local > 0) return;
  throw UsageError("batch: expected --slurm or --local N, found neither");
}

// The program that runs now, as jobs can call it.
fs::path ThisProgram() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) return program;
  const auto words = CommandLine();
  return words.empty() ? fs::path("dtr") : FindProgram(words.front());
}

// The words of `dtr build`, as that command understands them.
void ReadBuildWords(const std::vector<std::string>& words, const CommonOptions& common,
                    pipeline::BatchOptions& options) {
  CLI::App build("dtr build");
  BuildArguments arguments;
  AddBuildOptions(build, arguments);
  CommonOptions all = common;
  build.add_option("--seed", all.seed);  // among the words of a batch that is resumed
  std::vector<std::string> backwards(words.rbegin(), words.rend());
  try {
    build.parse(backwards);
  } catch (const CLI::ParseError& error) {
    throw UsageError(fmt::format("batch: `dtr build` of these words: {}", error.what()));
  }
  if (!arguments.stage.empty()) {
    throw UsageError("batch: runs all stages; leave out --stage and --part");
  }
  if (arguments.is_dynamic) {
    throw UsageError(
        "batch: time steps of a dynamic set follow each other; use dtr build, of parts (--from, "
        "--to) that dtr join joins");
  }
  FinishBuildArguments(all, arguments);
  options.build = arguments.options;
  options.words = words;
  if (common.seed != 0) {
    options.words.insert(options.words.end(), {"--seed", std::to_string(common.seed)});
  }
}

void SayState(const pipeline::BatchState& state, Console& console) {
  for (const pipeline::StageState& stage : state.stages) {
    std::string line =
        fmt::format("  {:14} {:4} of {:4} done", stage.stage, stage.done, stage.parts);
    if (stage.running > 0) line += fmt::format(", {} running", stage.running);
    if (stage.waiting > 0) line += fmt::format(", {} waiting", stage.waiting);
    if (stage.cpu_s > 0) line += fmt::format(", {:.0f} CPU s", stage.cpu_s);
    console.Say(line);
  }
  for (const std::string& line : state.failed) console.Say("  failed: " + line);
  if (state.finished) {
    console.Say(fmt::format("{}: finished", state.set.string()));
  } else if (!state.failed.empty()) {
    console.Say(fmt::format("dtr batch resume {} does what is missing", state.set.string()));
  }
}

int Run(const Context& context, const BatchArguments& arguments) {
  context.console.KeepsWork();
  const auto say = [&](const std::string& line) { context.console.Say(line); };
  const pipeline::BatchState state = pipeline::RunBatch(arguments.options, say, context.console);
  if (arguments.options.dry_run) return kDone;
  if (state.finished) {
    SayState(state, context.console);
  } else {
    context.console.Say(fmt::format("dtr batch status {} says how far it is", state.set.string()));
  }
  context.EmitJson(pipeline::ToJson(state));
  return kDone;
}

// What --local or --slurm of `resume` say replaces what the batch began with.
void AddResumeCommand(CLI::App& batch) {
  AddCommand(batch, "resume", "Do what is missing of a batch", "dtr batch resume scene.dtr",
             [](CLI::App& command) -> Action {
               auto set = std::make_shared<fs::path>();
               auto asked = std::make_shared<BatchArguments>();
               command.add_option("SET", *set, "The set that is being built, NAME.dtr")->required();
               AddRunOptions(command, *asked);
               return [set, asked](const Context& context) -> int {
                 BatchArguments arguments{pipeline::ReadBatch(*set), asked->slurm};
                 pipeline::BatchOptions& options = arguments.options;
                 options.program = ThisProgram();
                 const pipeline::BatchOptions& given = asked->options;
                 if (given.local > 0) options.local = given.local;
                 if (asked->slurm) {
                   options.local = 0;
                   const pipeline::SlurmOptions& asked_for = given.slurm;
                   if (!asked_for.partition.empty()) options.slurm.partition = asked_for.partition;
                   if (!asked_for.account.empty()) options.slurm.account = asked_for.account;
                   if (!asked_for.time.empty()) options.slurm.time = asked_for.time;
                   if (asked_for.cpus_per_task > 0) {
                     options.slurm.cpus_per_task = asked_for.cpus_per_task;
                   }
                 }
                 options.dry_run = given.dry_run;
                 if (context.common.threads > 0) options.threads = context.common.threads;
                 const auto words = options.words;
                 fs::current_path(options.directory);
                 ReadBuildWords(words, {}, options);
                 options.words = words;
                 return Run(context, arguments);
               };
             });
}

void AddStateCommands(CLI::App& batch) {
  AddCommand(batch, "status", "Say how far a batch is", "dtr batch status scene.dtr",
             [](CLI::App& command) -> Action {
               auto set = std::make_shared<fs::path>();
               command.add_option("SET", *set, "The set that is being built, NAME.dtr")->required();
               return [set](const Context& context) -> int {
                 const pipeline::BatchState state = pipeline::StateOfBatch(*set);
                 SayState(state, context.console);
                 context.EmitJson(pipeline::ToJson(state));
                 return kDone;
               };
             });
  AddCommand(batch, "cancel", "End the jobs of a batch that Slurm has; what is done stays",
             "dtr batch cancel scene.dtr", [](CLI::App& command) -> Action {
               auto set = std::make_shared<fs::path>();
               command.add_option("SET", *set, "The set that is being built, NAME.dtr")->required();
               return [set](const Context& context) -> int {
                 const int ended = pipeline::CancelBatch(*set);
                 context.console.Say(fmt::format("{} parts waited or ran and are ended", ended));
                 context.EmitJson(nlohmann::ordered_json{{"ended", ended}});
                 return kDone;
               };
             });
}

}  // namespace

void AddBatchCommand(CLI::App& app) {
  AddCommand(app, "batch", "dtr build PHOTOS -o SET.dtr as jobs of Slurm or processes here",
             "dtr batch photos/ -o scene.dtr --holdout every:8 --slurm --partition long",
             [](CLI::App& command) -> Action {
               auto arguments = std::make_shared<BatchArguments>();
               AddRunOptions(command, *arguments);
               command
                   .add_option("--array-size", arguments->options.array_size,
                               "Parts of a stage, at most [16]")
                   ->check(CLI::Range(1, 1000000))
                   ->type_name("N");
               command.allow_extras();
               AddStateCommands(command);
               AddResumeCommand(command);
               return [arguments, batch = &command](const Context& context) -> int {
                 if (!batch->get_subcommands().empty()) return kDone;
                 RequireWhere(*arguments);
                 pipeline::BatchOptions& options = arguments->options;
                 options.directory = fs::current_path();
                 options.program = ThisProgram();
                 options.threads = context.common.threads;
                 std::vector<std::string> words = batch->remaining();
                 if (context.common.force) words.emplace_back("--force");
                 ReadBuildWords(words, context.common, options);
                 return Run(context, *arguments);
               };
             });
}

}  // namespace dtr::cli
