#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <thread>

#include "cli/bench_tables.h"
#include "cli/command.h"
#include "cli/commands/bench_sweep.h"
#include "cli/render_options.h"
#include "cli/renderers.h"
#include "dtr/base/machine.h"
#include "dtr/eval/bench_json.h"
#include "dtr/io/set_io.h"
#include "dtr/render/time_steps.h"
#include "pipeline/core/view_names.h"
#include "pipeline/render/novel_frames.h"
#ifdef DTR_HAS_OSG
#include "cli/osg_bench.h"
#endif

namespace dtr::cli {
namespace {

struct BenchArguments {
  std::filesystem::path set;
  std::string table, size, like;  // table empty: a sweep
  std::vector<int> views, resolutions;
  int repeats = 10, cameras = 2;
  RendererChoice renderer;
  std::shared_ptr<RenderOptions> render;
  SweepRequest sweep;
};

/// Of the rows of tables.
std::vector<int> ResolutionsOf(const BenchArguments& options) {
  return options.resolutions.empty() ? std::vector{1, 2} : options.resolutions;
}

eval::BenchOptions BenchOptionsOf(const BenchArguments& options, const RenderOptions& render) {
  eval::BenchOptions bench;
  bench.render = render;
  bench.views = options.views;
  bench.resolutions = options.resolutions;
  bench.repeats = options.repeats;
  bench.cameras = options.cameras;
  bench.timed_camera = [size = options.size](const PinholeCamera& camera) {
    return pipeline::WithSize(camera, size);
  };
  return bench;
}

int RunPhotoTable(const BenchArguments& options, const RenderOptions& render, const DtrSet& set,
                  eval::TimedRenderer& renderer, const Context& context) {
  eval::BenchOptions bench = BenchOptionsOf(options, render);
  std::sort(bench.views.begin(), bench.views.end());
  bench.resolutions = ResolutionsOf(options);
  const bool weights = options.table == "weights";
  const eval::BenchReport report = (weights ? eval::MeasureWeightTable : eval::MeasureReportTable)(
      set, bench, renderer, context.console);
  const eval::BenchMachine machine = MachineOf(renderer);
  (weights ? SayWeightTable : SayReportTable)(report, machine, context.console);
  context.EmitJson(eval::ToJson(options.table, report, machine));
  return kDone;
}

int RunGrowthTable(const BenchArguments& options, RenderOptions render, const DtrSet& set,
                   eval::TimedRenderer& renderer, const Context& context) {
  if (!options.views.empty()) render.views = options.views.front();
  render.resolution = ResolutionsOf(options).front();
  NovelCamera novel;
  if (options.like.empty()) {
    // Between cameras, where no view has the image already; the middle is seen by most.
    constexpr int kStepsOfPath = 9;
    novel = FlyThrough(set, kStepsOfPath)[kStepsOfPath / 2];
  } else {
    const View& view = pipeline::FindView(set, options.like);
    novel = {view.camera, view.cam_from_world};
  }
  novel.camera = pipeline::WithSize(novel.camera, options.size);
  const auto series =
      eval::MeasureGrowth(set, novel, {render, options.repeats}, renderer, context.console);
  const eval::BenchMachine machine = MachineOf(renderer);
  SayGrowthTable(series, render.method, machine, context.console);
  context.EmitJson(eval::ToJson(series, render.method, machine));
  return kDone;
}

DtrSet LoadWhole(const BenchArguments& options, const Context& context) {
  io::LoadOptions load;
  load.held_out = load.completed = true;
  load.warn = [&context](const std::string& line) { context.console.Note(line); };
  return io::LoadSet(options.set, load);
}

#ifdef DTR_HAS_OSG
int RunOsgTable(const BenchArguments& options, const RenderOptions& render,
                const Context& context) {
  std::vector<RenderOptions> variants;
  const std::vector<int> views = options.views.empty() ? std::vector{3, 5, 8} : options.views;
  for (const int resolution : ResolutionsOf(options)) {
    for (const int count : views) {
      variants.push_back(render);
      variants.back().resolution = resolution;
      variants.back().views = count;
    }
  }
  DtrSet set = LoadWhole(options, context);
  std::vector<NovelCamera> path = FlyThrough(set, options.repeats);
  for (NovelCamera& novel : path) novel.camera = pipeline::WithSize(novel.camera, options.size);
  const OsgBench bench = MeasureOnOsg(std::move(set), path, variants, context.console);
  const eval::BenchMachine machine{CpuModel(), Cores(), bench.renderer, DTR_VERSION,
                                   bench.drawn_by_processor ? "processor" : "wall"};
  SayOsgTable(bench, machine, context.console);
  context.EmitJson(OsgJson(bench, machine));
  return kDone;
}
#else
int RunOsgTable(const BenchArguments&, const RenderOptions&, const Context&) {
  throw Error(
      "bench --table osg: expected a program built with OpenSceneGraph, found one without; install "
      "libopenscenegraph-dev and build again");
}
#endif

int RunBench(const BenchArguments& options, const Context& context) {
  RenderOptions render = *options.render;
  if (options.table.empty()) {
    SweepRequest request = options.sweep;
    request.set = options.set;
    request.bench = BenchOptionsOf(options, render);
    request.size = options.size;
    request.renderer = options.renderer;
    RequireOneFrame(io::ReadSet(options.set));
    return RunSweep(request, context);
  }
  if (options.table == "osg") return RunOsgTable(options, render, context);
  // Before anything is loaded: a machine without OpenGL should say so at once.
  const auto renderer = MakeTimedRenderer(options.renderer, context.console);
  const DtrSet set = LoadWhole(options, context);
  return options.table == "growth" ? RunGrowthTable(options, render, set, *renderer, context)
                                   : RunPhotoTable(options, render, set, *renderer, context);
}

void DeclareOptions(CLI::App& command, BenchArguments& options) {
  command.add_option("SET", options.set, "The set")->required();
  CLI::Option* table =
      command
          .add_option(
              "--table", options.table,
              "Without: error against cost, by stage. report: frames a second by views used and "
              "resolution, with the truth beside; "
              "weights: every blend weight and number of views, quality and cost; growth: how "
              "times grow with views, pixels and the size of the set; osg: what a frame takes "
              "in OpenSceneGraph, beside the same frame alone")
          ->check(CLI::IsMember({"report", "weights", "growth", "osg"}))
          ->type_name("report|weights|growth|osg");
  command.add_option("--size", options.size, "Size of the timed frames; 0 keeps the proportions")
      ->type_name("WxH");
  command
      .add_option("--repeats", options.repeats,
                  "Timed frames per row, after an untimed one (osg: after a lap of them) [10]")
      ->check(CLI::Range(1, 100000))
      ->type_name("N");
  command
      .add_option(
          "--cameras", options.cameras,
          "render, report, weights: so many held-out photos (or left-out ones) to look from [2]")
      ->check(CLI::Range(1, 100000))
      ->type_name("N");
  command.add_option("--like", options.like, "growth: from a view's position [between two]")
      ->type_name("VIEW");
  AddRendererOptions(command, options.renderer);
  options.render = AddRenderOptions(command);
  AddSweepOptions(command, table, options.sweep);
  // Here rows have them, one after the other; filling is timed apart.
  for (const char* single : {"--views", "--resolution", "--fill-holes"}) {
    command.remove_option(command.get_option(single));
  }
  command
      .add_option("--views", options.views,
                  "Numbers of views used, a row each; render: to try, the first the default "
                  "[8,1,2,3,4,6,12; report: 3,5,6,8,9,12,14; weights: 1,2,4,8; osg: "
                  "3,5,8]; growth: the "
                  "one for rows that do not change it [8]")
      ->delimiter(',')
      ->check(CLI::Range(1, 1024))
      ->type_name("K,...");
  command
      .add_option("--resolution", options.resolutions,
                  "Every R-th depth pixel per axis [1,2; render: 1,2,4]")
      ->delimiter(',')
      ->check(CLI::Range(1, 1024))
      ->type_name("R,...");
}

}  // namespace

void AddBenchCommand(CLI::App& app) {
  AddCommand(app, "bench", "Measure what settings cost and what they are worth",
             "dtr bench scene.dtr --stage render,storage", [](CLI::App& command) -> Action {
               auto options = std::make_shared<BenchArguments>();
               DeclareOptions(command, *options);
               return [options](const Context& context) { return RunBench(*options, context); };
             });
}

}  // namespace dtr::cli
