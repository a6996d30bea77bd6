#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/command.h"
#include "cli/render_options.h"
#include "cli/renderers.h"
#include "dtr/eval/held_out.h"
#include "dtr/eval/json.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "dtr/render/time_steps.h"
#include "pipeline/evaluate_depth.h"

namespace dtr::cli {
namespace {

namespace fs = std::filesystem;

struct EvaluateArguments {
  fs::path set, pictures, truth;
  bool leave_one_out = false;
  RendererChoice renderer;
  std::shared_ptr<RenderOptions> render;
};

// Held-out photos that found no camera when the set was built.
std::vector<std::string> NotRegistered(const DtrSet& set) {
  const auto provenance = nlohmann::json::parse(set.provenance_json);
  std::vector<std::string> names;
  // Provenance is free text to a reader of sets: what has another form tells nothing here.
  const auto listed = provenance.find("held_out_not_registered");
  if (listed == provenance.end() || !listed->is_array()) return names;
  for (const auto& name : *listed) {
    if (name.is_string()) names.push_back(name.get<std::string>());
  }
  return names;
}

std::string Figure(const std::optional<double>& value, const char* format) {
  if (!value) return "-";
  if (std::isinf(*value)) return "equal";
  return fmt::format(fmt::runtime(format), *value);
}

void SayScore(const eval::ViewScore& score, Console& console) {
  console.Say(fmt::format("{:<28} {:>9} {:>13} {:>7} {:>8.1f} %", score.name,
                          Figure(score.psnr_db, "{:.2f}"), Figure(score.psnr_covered_db, "{:.2f}"),
                          Figure(score.ssim, "{:.4f}"), 100 * score.coverage));
}

void SayReport(const eval::EvaluationReport& report, Console& console) {
  if (!report.views.empty()) {
    console.Say(fmt::format("{:<28} {:>9} {:>13} {:>7} {:>10}",
                            report.leave_one_out ? "left out" : "held out", "PSNR dB", "on seen dB",
                            "SSIM", "seen"));
    for (const eval::ViewScore& score : report.views) SayScore(score, console);
    eval::ViewScore mean = report.mean;
    mean.name = "mean";
    SayScore(mean, console);
  }
  for (const std::string& name : report.not_registered) {
    console.Say("not registered, so not in the means: " + name);
  }
}

void SayDepth(const eval::DepthScores& depth, Console& console) {
  const auto percent = [](const std::optional<double>& share) {
    return share ? fmt::format("{:.1f} %", 100 * *share) : std::string("-");
  };
  console.Say(fmt::format(
      "depth: {} of true pixels have one; within 1 %: {}, 2 %: {}; within 1 px: {}; outliers: {}",
      percent(depth.depth_completeness), percent(depth.share_within_1pct),
      percent(depth.share_within_2pct), percent(depth.share_within_1px),
      percent(depth.outlier_share)));
  console.Say(fmt::format(
      "depth edges: displaced by {} px, grown by {} px, {} found; errors within 1, 2, 3 sigma: {}, "
      "{}, {}; sparsification {} times the oracle's ({} if errors were normal)",
      Figure(depth.edges.displacement_px, "{:.2f}"), Figure(depth.edges.fattening_px, "{:.2f}"),
      percent(depth.edges.found_share), percent(depth.sigma.share_within_1_sigma),
      percent(depth.sigma.share_within_2_sigma), percent(depth.sigma.share_within_3_sigma),
      Figure(depth.sigma.sparsification_ratio, "{:.2f}"),
      Figure(depth.sigma.sparsification_ratio_if_normal, "{:.2f}")));
  const std::vector<double>& outliers = depth.sigma.outlier_share_by_tenth;
  if (outliers.empty()) return;
  // Half, and nine tenths.
  console.Say(fmt::format("outliers among the most certain half: {}, nine tenths: {}",
                          percent(outliers.at(4)), percent(outliers.at(8))));
}

int RunEvaluate(const EvaluateArguments& options, const Context& context) {
  if (fs::exists(options.pictures) && !fs::is_directory(options.pictures)) {
    throw UsageError(
        fmt::format("--pictures {}: expected a folder, found a file", options.pictures.string()));
  }
  io::LoadOptions load;
  load.held_out = true;
  load.sigma = !options.truth.empty();
  load.threads = context.common.threads;
  load.warn = [&context](const std::string& line) { context.console.Note(line); };
  const DtrSet set = io::LoadSet(options.set, load);
  RequireOneFrame(set);

  std::optional<eval::DepthScores> depth;
  if (!options.truth.empty()) {
    depth = pipeline::EvaluateDepth(set, options.truth, context.common.threads, context.console);
  }
  eval::EvaluateOptions evaluate;
  evaluate.leave_one_out = options.leave_one_out;
  evaluate.render = *options.render;
  evaluate.render.threads = context.common.threads;
  evaluate.not_registered = NotRegistered(set);
  if (!options.pictures.empty()) {
    fs::create_directories(options.pictures);
    evaluate.on_rendered = [&](const View& view, const RenderResult& filled) {
      io::WriteImage(options.pictures / (view.id + ".png"),
                     eval::ComparisonImage(filled.image, view.image, view.mask));
    };
  }
  const bool has_held_out =
      std::any_of(set.frames.front().views.begin(), set.frames.front().views.end(),
                  [](const View& view) { return view.role == ViewRole::kHeldOut; });
  eval::EvaluationReport report;
  // With truth alone there is still something to measure.
  if (!options.leave_one_out && !has_held_out && !evaluate.not_registered.empty()) {
    report.not_registered = evaluate.not_registered;  // every held-out photo is lost: counted
  } else if (options.leave_one_out || has_held_out || !depth) {
    report = eval::EvaluateHeldOut(set, evaluate, MakeRenderer(options.renderer, context.console),
                                   context.console);
  }
  SayReport(report, context.console);
  if (depth) SayDepth(*depth, context.console);
  context.EmitJson(eval::ToJson(report, depth));
  return kDone;
}

}  // namespace

void AddEvaluateCommand(CLI::App& app) {
  AddCommand(
      app, "evaluate", "Measure a set by photos it was not made from, or against true depth",
      "dtr evaluate scene.dtr --json -", [](CLI::App& command) -> Action {
        auto options = std::make_shared<EvaluateArguments>();
        command.add_option("SET", options->set, "The set")->required();
        command.add_flag("--leave-one-out", options->leave_one_out,
                         "Leave every source view out of rendering in turn, instead");
        command.add_option("--depth", options->truth, "Folder with cameras.json and true depth/")
            ->type_name("TRUTH");
        command
            .add_option("--pictures", options->pictures,
                        "Write rendering | photo | difference for every view")
            ->type_name("DIR");
        AddRendererOptions(command, options->renderer);
        options->render = AddRenderOptions(command);
        return [options, &command](const Context& context) {
          UseStoredArguments(command, io::ReadSet(options->set), *options->render);
          return RunEvaluate(*options, context);
        };
      });
}

}  // namespace dtr::cli
