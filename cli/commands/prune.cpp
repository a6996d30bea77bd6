#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>

#include "cli/command.h"
#include "cli/number_checks.h"
#include "cli/render_arguments.h"
#include "cli/render_options.h"
#include "cli/renderers.h"
#include "dtr/io/set_io.h"
#include "pipeline/prune/prune.h"

namespace dtr::cli {
namespace {

struct PruneArguments {
  pipeline::PruneSetOptions prune;
  RendererChoice renderer;
  std::shared_ptr<RenderOptions> render;
};

void SayResult(const PruneArguments& options, const pipeline::PruneSetReport& report,
               Console& console) {
  const prune::PruneReport& pruned = report.pruned;
  const auto megabytes = [](std::uint64_t bytes) { return static_cast<double>(bytes) / 1e6; };
  console.Say(fmt::format(
      "{}: {:.1f} MB of {:.1f} ({:.1f} times fewer bytes), frames {:.1f} ms of {:.1f} ({:.1f} "
      "times "
      "as fast), {:.3f} dB lost of {:g} allowed",
      options.prune.output.string(), megabytes(report.bytes_after), megabytes(report.bytes_before),
      static_cast<double>(report.bytes_before) / static_cast<double>(report.bytes_after),
      report.frame_after.median_ms, report.frame_before.median_ms,
      report.frame_before.median_ms / report.frame_after.median_ms, pruned.loss_db(),
      options.prune.prune.max_loss_db));
  console.Say(fmt::format(
      "  between input cameras: {:.3f} +- {:.3f} dB; on photos that did not decide: "
      "{:.3f} +- {:.3f} dB; on held-out ones: {}",
      pruned.checked_probe_loss_db, pruned.probe_error_db, pruned.witness_loss_db,
      pruned.witness_error_db,
      pruned.photo_loss_db ? fmt::format("{:.3f} dB, whole frames {:.3f} dB", *pruned.photo_loss_db,
                                         pruned.photo_frame_loss_db.value_or(0))
                           : std::string("there are none")));
  if (pruned.photo_loss_db.value_or(0) > options.prune.prune.max_loss_db) {
    console.Note(
        "WARNING: held-out photos lose more than was allowed; give a smaller --max-loss-db");
  }
  if (const size_t count = pruned.put_back.size(); count > 0) {
    console.Say(fmt::format("  {} decision{} taken back, as other positions showed more loss",
                            count, count == 1 ? "" : "s"));
  }
  const auto render = RenderOptionArguments(pruned.setting.render);
  console.Say(fmt::format("  dtr info {} says what was left out; drawn with: {}",
                          options.prune.output.string(),
                          render.empty() ? std::string("the usual options")
                                         : fmt::format("{}", fmt::join(render, " "))));
}

int RunPrune(PruneArguments& options, const Context& context) {
  context.console.KeepsWork();
  options.prune.prune.seed = context.common.seed;
  options.prune.prune.render = *options.render;
  options.prune.renderer = options.renderer.name;
  options.prune.make_renderer = [&] { return MakeRenderer(options.renderer, context.console); };
  options.prune.make_timed_renderer = [&] {
    return MakeTimedRenderer(options.renderer, context.console);
  };
  // Before anything is loaded: a machine without OpenGL should say so at once.
  (void)options.prune.make_renderer();
  const auto report = pipeline::PruneSet(options.prune, context.console);
  SayResult(options, report, context.console);
  context.EmitJson(pipeline::ToJson(options.prune, report));
  return kDone;
}

}  // namespace

void AddPruneCommand(CLI::App& app) {
  AddCommand(
      app, "prune", "Leave out what a set's images do not need",
      "dtr prune scene.dtr -o small.dtr --max-loss-db 0.1", [](CLI::App& command) -> Action {
        auto options = std::make_shared<PruneArguments>();
        prune::PruneOptions& prune = options->prune.prune;
        command.add_option("SET", options->prune.set, "The set; it is only read")->required();
        command.add_option("-o,--output", options->prune.output, "The set to write")
            ->required()
            ->type_name("SET2.dtr");
        command
            .add_option("--max-loss-db", prune.max_loss_db,
                        "How much worse rendered images may get, PSNR in dB, mean over positions "
                        "that decided "
                        "nothing [0.1]")
            ->check(CLI::Range(0.0, 20.0))
            ->type_name("L");
        command
            .add_option(
                "--max-bytes", options->prune.max_bytes,
                "Enough is left out when the set takes no more than N bytes; exit 1 where the "
                "loss does not allow that")
            ->check(kPositive)
            ->type_name("N");
        command
            .add_option("--frame-ms", options->prune.frame_ms,
                        "Enough is left out when frames take no more than T ms (with --max-bytes: "
                        "when both hold); exit 1 where the loss does not allow that")
            ->check(kPositive)
            ->type_name("T");
        command
            .add_option("--probes", prune.probes,
                        "Source views whose photos decide, each left out in turn [12]")
            ->check(CLI::Range(1, 1000))
            ->type_name("N");
        command
            .add_option("--checks", prune.checks,
                        "So many novel cameras decide, and as many others, and photos that did not "
                        "decide, check [8]")
            ->check(CLI::Range(1, 1000))
            ->type_name("N");
        command
            .add_option("--probe-crop", prune.probe_crop,
                        "Of deciding photos a window of 1/N per axis counts; checking frames are "
                        "whole [2]")
            ->check(CLI::Range(1, 16))
            ->type_name("N");
        command.add_flag("--force", options->prune.force, "Replace SET2 when it exists");
        AddRendererOptions(command, options->renderer);
        options->render = AddRenderOptions(command);
        return [options, &command](const Context& context) {
          UseStoredOptions(command, io::ReadSet(options->prune.set), *options->render);
          return RunPrune(*options, context);
        };
      });
}

}  // namespace dtr::cli
