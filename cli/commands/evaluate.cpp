#include "pipeline/evaluate/evaluate.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/command.h"
#include "cli/render_options.h"
#include "cli/renderers.h"
#include "dtr/eval/json.h"
#include "dtr/io/set_io.h"

namespace dtr::cli {
namespace {

struct EvaluateArguments {
  pipeline::EvaluateRequest request;
  RendererChoice renderer;
  std::shared_ptr<RenderOptions> render;
};

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
    console.Say(fmt::format("mean PSNR after the best gain and offset of each channel: {} dB",
                            Figure(mean.psnr_cc_db, "{:.2f}")));
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
  if (depth.completed_pixels > 0) {
    console.Say(fmt::format("completed depth: {} of its pixels within 5 % of the true surface",
                            percent(depth.completed_share_within_5pct)));
  }
  const std::vector<double>& outliers = depth.sigma.outlier_share_by_tenth;
  if (outliers.empty()) return;
  // Half, and nine tenths.
  console.Say(fmt::format("outliers among the most certain half: {}, nine tenths: {}",
                          percent(outliers.at(4)), percent(outliers.at(8))));
}

void SayFlicker(const eval::FlickerScores& flicker, Console& console) {
  const auto percent = [](const std::optional<double>& share) {
    return share ? fmt::format("{:.4f} %", 100 * *share) : std::string("-");
  };
  console.Say(fmt::format(
      "flicker where truth stands still ({} pixels): standard deviation of depth over time {} of "
      "depth in the mean, {} in the median; depth comes or goes in {} of the time steps",
      flicker.pixels, percent(flicker.mean_relative_deviation),
      percent(flicker.median_relative_deviation), percent(flicker.come_and_go_share)));
}

// Of a dynamic set, with what the report of a still one has in the same places.
std::string JsonOverTime(const pipeline::EvaluateResult& result) {
  auto json = nlohmann::ordered_json::parse(eval::ToJson(result.views, result.depth));
  json["time_steps"] = result.time_steps;
  if (result.flicker) {
    const auto number = [](const std::optional<double>& value) {
      return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
    };
    json["flicker"] = {
        {"still_pixels", result.flicker->still_pixels},
        {"pixels", result.flicker->pixels},
        {"mean_relative_deviation", number(result.flicker->mean_relative_deviation)},
        {"median_relative_deviation", number(result.flicker->median_relative_deviation)},
        {"come_and_go_share", number(result.flicker->come_and_go_share)}};
  }
  return json.dump(2);
}

int RunEvaluate(const EvaluateArguments& options, const Context& context) {
  pipeline::EvaluateRequest request = options.request;
  request.render = *options.render;
  request.force = context.common.force;
  const auto result = pipeline::Evaluate(
      request, [&] { return MakeRenderer(options.renderer, context.console); }, context.console);
  SayReport(result.views, context.console);
  if (result.depth) SayDepth(*result.depth, context.console);
  if (result.flicker) SayFlicker(*result.flicker, context.console);
  context.EmitJson(result.time_steps > 1 ? JsonOverTime(result)
                                         : eval::ToJson(result.views, result.depth));
  return kDone;
}

}  // namespace

void AddEvaluateCommand(CLI::App& app) {
  AddCommand(app, "evaluate", "Measure a set by photos it was not made from, or against true depth",
             "dtr evaluate scene.dtr --json -", [](CLI::App& command) -> Action {
               auto options = std::make_shared<EvaluateArguments>();
               command.add_option("SET", options->request.set, "The set")->required();
               command.add_flag("--leave-one-out", options->request.leave_one_out,
                                "Leave every source view out of rendering in turn, instead");
               command
                   .add_option("--depth", options->request.truth,
                               "Folder with cameras.json and true depth/")
                   ->type_name("TRUTH");
               command
                   .add_option("--images,--pictures", options->request.images,
                               "Write rendering | photo | difference for every view")
                   ->type_name("DIR");
               AddMeasuredOnly(command, options->request.measured_only);
               AddRendererOptions(command, options->renderer);
               options->render = AddRenderOptions(command, WholeFrames());
               return [options, &command](const Context& context) {
                 UseStoredOptions(command, io::ReadSet(options->request.set), *options->render);
                 return RunEvaluate(*options, context);
               };
             });
}

}  // namespace dtr::cli
