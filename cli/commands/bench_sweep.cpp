#include "cli/commands/bench_sweep.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "cli/number_checks.h"
#include "cli/render_arguments.h"
#include "cli/shell_words.h"
#include "cli/sweep_output.h"
#include "cli/sweep_store.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/hash.h"
#include "dtr/base/machine.h"
#include "dtr/base/temporary_folder.h"
#include "dtr/eval/render_sweep.h"
#include "dtr/io/set_io.h"
#include "pipeline/bench/calibration_sweep.h"
#include "pipeline/bench/stereo_sweep.h"
#include "pipeline/bench/storage_sweep.h"
#include "pipeline/core/photos/input_hash.h"

namespace dtr::cli {
namespace {

namespace fs = std::filesystem;

/// One stage ready to be measured, with what it needs to live.
class Measurable {
 public:
  virtual ~Measurable() = default;
  virtual eval::SweepStage Stage() const = 0;
  /// For people: how it is measured.
  virtual std::string Conditions() const = 0;
  /// Arguments that, with --point, measure under the same conditions.
  virtual std::vector<std::string> Arguments() const = 0;
  /// What decides a measurement beside set, arguments and axes.
  virtual std::string Inputs() const { return {}; }
};

std::vector<std::string> RendererArguments(const SweepRequest& request) {
  std::vector<std::string> arguments;
  if (request.renderer.name != RendererChoice{}.name)
    arguments = {"--renderer", request.renderer.name};
  if (!request.renderer.shader_folder.empty()) {
    arguments.insert(arguments.end(), {"--shader-dir", request.renderer.shader_folder.string()});
  }
  if (request.renderer.gpu_memory_gb != RendererChoice{}.gpu_memory_gb) {
    arguments.insert(arguments.end(),
                     {"--gpu-memory", fmt::format("{}", request.renderer.gpu_memory_gb)});
  }
  const auto render = RenderOptionArguments(request.bench.render);
  arguments.insert(arguments.end(), render.begin(), render.end());
  return arguments;
}

void AppendList(const char* flag, const std::vector<int>& values,
                std::vector<std::string>& arguments) {
  if (values.empty()) return;
  arguments.insert(arguments.end(), {flag, fmt::format("{}", fmt::join(values, ","))});
}

class RenderStage final : public Measurable {
 public:
  RenderStage(const SweepRequest& request, const Context& context, eval::TimedRenderer& renderer)
      : request_(request),
        set_(Load(request.set, context)),
        sweep_(set_, {request.bench}, renderer, context.console) {}
  eval::SweepStage Stage() const override { return sweep_.Stage(); }
  std::string Conditions() const override {
    const std::vector<std::string> names = sweep_.Cameras();
    return fmt::format(
        "seen from {} ({}); frames timed at {}; median of {} frames after an untimed one, mean "
        "over the cameras; PSNR over whole frames, holes filled and edges smoothed, at the photo's "
        "own size",
        names.size() == 1 ? "1 photo" : fmt::format("{} photos", names.size()),
        fmt::join(names, ", "), request_.size.empty() ? "the photo's size" : request_.size,
        request_.bench.repeats);
  }
  std::vector<std::string> Arguments() const override {
    std::vector<std::string> arguments = RendererArguments(request_);
    AppendList("--views", request_.bench.views, arguments);
    AppendList("--resolution", request_.bench.resolutions, arguments);
    arguments.insert(arguments.end(), {"--cameras", std::to_string(request_.bench.cameras),
                                       "--repeats", std::to_string(request_.bench.repeats)});
    if (!request_.size.empty()) arguments.insert(arguments.end(), {"--size", request_.size});
    return arguments;
  }

 private:
  static DtrSet Load(const fs::path& folder, const Context& context) {
    io::LoadOptions load;
    load.held_out = load.completed = true;
    load.warn = [&context](const std::string& line) { context.console.Note(line); };
    return io::LoadSet(folder, load);
  }

  const SweepRequest& request_;
  const DtrSet set_;
  const eval::RenderSweep sweep_;
};

fs::path OutputFolder(const SweepRequest& request) {
  return request.output.empty() ? SweepFolderOf(request.set) : request.output;
}

class CalibrationStage final : public Measurable {
 public:
  CalibrationStage(const SweepRequest& request, const Context& context, const fs::path& work)
      : request_(request),
        sweep_({request.set, request.photos, work / "calibrations", request.feature_sizes_px,
                context.common.seed},
               context.console) {}
  eval::SweepStage Stage() const override { return sweep_.Stage(); }
  std::string Conditions() const override { return sweep_.Conditions(); }
  std::string Inputs() const override { return sweep_.Identity(); }
  std::vector<std::string> Arguments() const override {
    std::vector<std::string> arguments = RendererArguments(request_);
    arguments.insert(arguments.end(), {"--photos", request_.photos.string()});
    AppendList("--feature-size", request_.feature_sizes_px, arguments);
    // There COLMAP's results lie, which it would not find again.
    if (request_.point.empty() || !request_.output.empty()) {
      arguments.insert(arguments.end(), {"-o", OutputFolder(request_).string()});
    }
    return arguments;
  }

 private:
  const SweepRequest& request_;
  const pipeline::CalibrationSweep sweep_;
};

/// The two stages that write sets: Options and Sweep are those of either.
template <typename Sweep>
class SetStage final : public Measurable {
 public:
  template <typename Options>
  SetStage(const SweepRequest& request, Options options, Console& console)
      : request_(request), sweep_(std::move(options), console) {}
  eval::SweepStage Stage() const override { return sweep_.Stage(); }
  std::string Conditions() const override {
    return "one run of each; PSNR over all held-out photos (without any: source photos left out in "
           "turn), whole frames, holes filled and edges smoothed, at their own size";
  }
  std::vector<std::string> Arguments() const override {
    std::vector<std::string> arguments = RendererArguments(request_);
    AppendList("--max-size", request_.max_sizes_px, arguments);
    if (!request_.truth.empty()) {
      arguments.insert(arguments.end(), {"--truth", request_.truth.string()});
    }
    return arguments;
  }

 private:
  const SweepRequest& request_;
  const Sweep sweep_;
};

std::unique_ptr<Measurable> MakeStage(const std::string& name, const SweepRequest& request,
                                      const Context& context, const fs::path& work,
                                      eval::TimedRenderer& renderer) {
  if (name == "render") return std::make_unique<RenderStage>(request, context, renderer);
  if (name == "calibration") {
    // A single point leaves something behind only where it is told to.
    return std::make_unique<CalibrationStage>(request, context,
                                              request.output.empty() ? work : request.output);
  }
  const auto make_renderer = [&request, &context] {
    return MakeRenderer(request.renderer, context.console);
  };
  if (name == "stereo") {
    pipeline::StereoSweepOptions options{
        request.set,          work,          request.truth,      request.max_sizes_px,
        request.bench.render, make_renderer, context.common.seed};
    return std::make_unique<SetStage<pipeline::StereoSweep>>(request, options, context.console);
  }
  pipeline::StorageSweepOptions options{request.set, work, request.bench.render, make_renderer};
  return std::make_unique<SetStage<pipeline::StorageSweep>>(request, options, context.console);
}

/// What decides a measurement, but for the setting: of two equal ones one is enough.
std::string ContextOf(const SweepRequest& request, const Measurable& measurable,
                      const std::vector<std::string>& arguments, const Context& context,
                      const eval::BenchMachine& machine) {
  std::string text = Sha256OfFile(request.set / "set.json") + "\n" + machine.version + "\n" +
                     machine.renderer + "\n" + machine.cpu + "\n" +
                     std::to_string(context.common.threads) + " " +
                     std::to_string(context.common.seed) + "\n" + ShellLine(arguments);
  // Photos to measure with, and truth: set.json knows neither.
  const DtrSet set = io::ReadSet(request.set);
  for (const View& view : set.frames.front().views) {
    if (view.role == ViewRole::kHeldOut && view.image_file) text += "\n" + view.image_file->sha256;
  }
  if (!request.truth.empty()) text += "\n" + pipeline::InputHash(request.truth);
  if (const std::string inputs = measurable.Inputs(); !inputs.empty()) text += "\n" + inputs;
  for (const eval::SweepAxis& axis : measurable.Stage().axes) {
    text += "\n" + axis.name + "=" + axis.values.front();
  }
  return Sha256(std::as_bytes(std::span(text)));
}

[[noreturn]] void RejectPoint(const std::string& word, const std::string& expected) {
  throw UsageError(fmt::format("--point: expected {}, found '{}'", expected, word));
}

eval::SweepSetting SettingOf(const eval::SweepStage& stage, const std::string& text) {
  eval::SweepSetting setting(stage.axes.size(), 0);
  if (text == "default") return setting;
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, ',');) {
    const size_t equals = word.find('=');
    const std::string name = word.substr(0, equals);
    const auto axis = std::find_if(stage.axes.begin(), stage.axes.end(),
                                   [&](const eval::SweepAxis& one) { return one.name == name; });
    if (equals == std::string::npos || axis == stage.axes.end()) {
      std::vector<std::string> names;
      for (const eval::SweepAxis& one : stage.axes) names.push_back(one.name);
      RejectPoint(word, fmt::format("default or NAME=VALUE,... with names of {{{}}}",
                                    fmt::join(names, ",")));
    }
    const auto value = std::find(axis->values.begin(), axis->values.end(), word.substr(equals + 1));
    if (value == axis->values.end()) {
      RejectPoint(word,
                  fmt::format("a value of {{{}}} for {}", fmt::join(axis->values, ","), name));
    }
    setting[static_cast<size_t>(axis - stage.axes.begin())] =
        static_cast<int>(value - axis->values.begin());
  }
  return setting;
}

/// "method=deferred,views=3,...": every axis, so that the command means the same when defaults have
/// become others.
std::string PointText(const eval::SweepStage& stage, const eval::SweepSetting& setting) {
  std::vector<std::string> words;
  for (size_t axis = 0; axis < stage.axes.size(); ++axis) {
    words.push_back(stage.axes[axis].name + "=" +
                    stage.axes[axis].values.at(static_cast<size_t>(setting[axis])));
  }
  return fmt::format("{}", fmt::join(words, ","));
}

std::string CommandOf(const SweepRequest& request, const eval::SweepStage& stage,
                      const eval::SweepSetting& setting, const std::vector<std::string>& arguments,
                      const CommonOptions& common) {
  std::vector<std::string> words{"dtr",      "bench",   request.set.string(),     "--stage",
                                 stage.name, "--point", PointText(stage, setting)};
  words.insert(words.end(), arguments.begin(), arguments.end());
  if (common.threads != 0) {
    words.insert(words.end(), {"--threads", std::to_string(common.threads)});
  }
  if (common.seed != 0) words.insert(words.end(), {"--seed", std::to_string(common.seed)});
  return ShellLine(words);
}

/// Keeps nothing: a single point is measured when it is asked for.
class NoStore final : public eval::SweepStore {
 public:
  std::optional<eval::SweepMeasurement> Find(const eval::SweepSetting&) const override {
    return std::nullopt;
  }
  void Keep(const eval::SweepSetting&, const eval::SweepMeasurement&) override {}
};

SweptStage SweepOne(const Measurable& measurable, const SweepRequest& request,
                    const Context& context, const eval::BenchMachine& machine, SweepFile* file) {
  SweptStage swept;
  swept.stage = measurable.Stage();
  const std::vector<std::string> arguments = measurable.Arguments();
  if (file == nullptr) {
    swept.points = {eval::MeasurePoint(swept.stage, SettingOf(swept.stage, request.point))};
  } else {
    const auto store =
        file->Of(swept.stage, ContextOf(request, measurable, arguments, context, machine));
    swept.points = eval::Sweep(swept.stage, request.max_points, *store, context.console);
  }
  for (const eval::SweepPoint& point : swept.points) {
    swept.commands.push_back(
        CommandOf(request, swept.stage, point.setting, arguments, context.common));
  }
  swept.conditions = measurable.Conditions();
  swept.max_loss_db = request.max_loss_db;
  if (swept.stage.name == "render") swept.budget = request.budget_ms;
  swept.FindDefaults();
  return swept;
}

void Check(const SweepRequest& request) {
  const auto has = [&](const char* stage) {
    return std::find(request.stages.begin(), request.stages.end(), stage) != request.stages.end();
  };
  if (!request.point.empty() && request.stages.size() != 1) {
    throw UsageError("--point: expected one --stage with it, found several");
  }
  if (!request.point.empty() && !request.output.empty() && !has("calibration")) {
    throw UsageError(
        "--point: expected no --output beside it, for one setting writes no folder; give --json "
        "FILE");
  }
  if (request.budget_ms && !has("render")) {
    throw UsageError("--budget-ms: expected --stage render with it, whose frames it is about");
  }
  if ((!request.truth.empty() || !request.max_sizes_px.empty()) && !has("stereo")) {
    throw UsageError("--truth, --max-size: expected --stage stereo with them");
  }
  if ((!request.photos.empty() || !request.feature_sizes_px.empty()) && !has("calibration")) {
    throw UsageError("--photos, --feature-size: expected --stage calibration with them");
  }
  if (has("calibration") && request.photos.empty()) {
    throw UsageError(
        "--stage calibration: expected --photos with it, the folder that the set was built from");
  }
  if (!fs::exists(request.set)) {
    throw Error(request.set.string() + ": expected the folder of a D+TR set, found nothing");
  }
}

}  // namespace

eval::BenchMachine MachineOf(const eval::TimedRenderer& renderer) {
  return {CpuModel(), Cores(), renderer.Description(), DTR_VERSION,
          renderer.HasGpuClock() ? "gpu timer" : "wall"};
}

void AddSweepOptions(CLI::App& command, CLI::Option* table, SweepRequest& request) {
  command
      .add_option("--stage", request.stages,
                  "Stages to sweep: render; stereo: depth by engine, preset and image size; "
                  "storage: codings and planes; calibration: options of SfM, of --photos [render]")
      ->delimiter(',')
      ->check(CLI::IsMember({"render", "stereo", "storage", "calibration"}))
      ->excludes(table)
      ->type_name("render|stereo|storage|calibration,...");
  command
      .add_option("--point", request.point,
                  "Measure this one setting, default or NAME=VALUE,..., instead of a sweep")
      ->excludes(table)
      ->type_name("SETTING");
  command
      .add_option(
          "-o,--output", request.output,
          "Folder for bench.json, .csv, .html, the plots and work.json, from which the same "
          "command goes on [NAME-bench beside the set]")
      ->excludes(table)
      ->type_name("DIR");
  command.add_option("--max-points", request.max_points, "Max settings measured per stage [60]")
      ->check(CLI::Range(1, 100000))
      ->excludes(table)
      ->type_name("N");
  command
      .add_option("--max-loss-db", request.max_loss_db,
                  "Name the cheapest setting that loses no more against the best [0.1]")
      ->check(kNonNegative)
      ->excludes(table)
      ->type_name("DB");
  command
      .add_option("--budget-ms", request.budget_ms,
                  "Name the best setting whose frames take no longer")
      ->check(kPositive)
      ->excludes(table)
      ->type_name("MS");
  command
      .add_option("--max-size", request.max_sizes_px,
                  "stereo: long sides of the images to try, the first the default; 0: as they are "
                  "[as they are, seven tenths, half]")
      ->delimiter(',')
      ->check(CLI::Range(0, 1000000))
      ->excludes(table)
      ->type_name("PX,...");
  command
      .add_option("--photos", request.photos,
                  "calibration: folder of the photos the set was built from")
      ->check(CLI::ExistingDirectory)
      ->excludes(table)
      ->type_name("DIR");
  command
      .add_option("--feature-size", request.feature_sizes_px,
                  "calibration: long sides for features to try, the first the default; 0: what "
                  "memory allows [that, seven tenths, half]")
      ->delimiter(',')
      ->check(CLI::Range(0, 65536))
      ->excludes(table)
      ->type_name("PX,...");
  command
      .add_option("--truth", request.truth,
                  "stereo: folder with cameras.json and true depth/ to measure depth against")
      ->check(CLI::ExistingDirectory)
      ->excludes(table)
      ->type_name("DIR");
}

// Results are written over those of an earlier run of this command, and over nothing else.
void RequireOwnFolder(const fs::path& folder) {
  if (fs::exists(folder / kWorkFile)) return;
  for (const char* name : {kSweepFile, "bench.csv", "bench.html"}) {
    if (!fs::exists(folder / name)) continue;
    throw UsageError(fmt::format(
        "-o {}: holds a file {} that is of no unfinished sweep; choose another folder or give "
        "--force",
        folder.string(), name));
  }
}

int RunSweep(const SweepRequest& request, const Context& context) {
  if (request.point.empty()) context.console.KeepsWork();
  Check(request);
  const auto renderer = MakeTimedRenderer(request.renderer, context.console);
  SweepRun run;
  run.set = request.set.string();
  run.machine = MachineOf(*renderer);
  const bool one_point = !request.point.empty();
  std::optional<TemporaryFolder> scratch;  // a single point leaves nothing behind
  if (one_point) scratch.emplace();
  const fs::path output = one_point ? scratch->path() : OutputFolder(request);
  if (!one_point && !context.common.force) RequireOwnFolder(output);
  fs::create_directories(output);
  std::optional<SweepFile> file;
  if (!one_point) file.emplace(output / kWorkFile);
  for (const std::string& name : request.stages) {
    const auto measurable = MakeStage(name, request, context, output, *renderer);
    run.stages.push_back(
        SweepOne(*measurable, request, context, run.machine, file ? &*file : nullptr));
  }
  const nlohmann::ordered_json json = SweepJson(run);
  const SweepFacts facts = FactsOf(json, kSweepFile);
  if (!one_point) {
    WriteFileAtomically(output / kSweepFile, json.dump(1) + "\n");
    WriteFileAtomically(output / "bench.csv", SweepCsv(run));
    WriteFileAtomically(output / "bench.html", SweepPage(facts));
    for (const auto& [name, svg] : SweepPlots(facts)) {
      WriteFileAtomically(output / (name + ".svg"), svg);
    }
  }
  SaySweep(facts, context.console);
  if (!one_point) context.console.Say("written: " + (output / "bench.html").string());
  context.EmitJson(json);
  return kDone;
}

}  // namespace dtr::cli
