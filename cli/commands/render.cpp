#include "pipeline/render/render.h"

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "cli/command.h"
#include "cli/output_file.h"
#include "cli/render_options.h"
#include "cli/renderers.h"
#include "dtr/io/set_io.h"

namespace dtr::cli {
namespace {

struct RenderArguments {
  pipeline::RenderRequest request;
  RendererChoice renderer;
  std::shared_ptr<RenderOptions> render;
};

// Everything about the outputs that can be known before the work.
void RequireOutputs(const pipeline::RenderRequest& request) {
  if (request.output.extension() == ".mp4") {
    RequireFolderOf(request.output, "-o");
  } else if (!request.several()) {
    RequireOutputFile(request.output, "-o", {".png", ".jpg", ".jpeg"});
  }
  if (!request.depth_out.empty()) RequireOutputFile(request.depth_out, "--depth-out", {".exr"});
  if (!request.coverage_out.empty()) {
    RequireOutputFile(request.coverage_out, "--coverage-out", {".png"});
  }
}

std::string ToJson(const pipeline::RenderReport& report) {
  nlohmann::ordered_json json{{"frames", nlohmann::ordered_json::array()},
                              {"skipped", nlohmann::ordered_json::array()}};
  for (const pipeline::RenderedFile& frame : report.frames) {
    json["frames"].push_back({{"file", frame.file},
                              {"ms", frame.render_ms},
                              {"frame", frame.frame},
                              {"views_used", frame.views_used},
                              {"coverage", frame.coverage}});
  }
  for (const auto& [name, reason] : report.skipped) {
    json["skipped"].push_back({{"name", name}, {"reason", reason}});
  }
  return json.dump(1);
}

int RunRender(const RenderArguments& options, const DtrSet& described, const Context& context) {
  pipeline::RenderRequest request = options.request;
  request.render = *options.render;
  request.force = context.common.force;
  const pipeline::RenderReport report = pipeline::Render(
      request, described,
      [&] {
        RequireOutputs(request);  // its cameras are there
        return MakeRenderer(options.renderer, context.console);
      },
      context.console);
  context.console.Say(fmt::format("{}: {} frame{}", request.output.string(), report.frames.size(),
                                  request.several() ? "s" : ""));
  context.EmitJson(ToJson(report));
  return kDone;
}

}  // namespace

void AddRenderCommand(CLI::App& app) {
  AddCommand(
      app, "render", "Render new views of a set",
      "dtr render scene.dtr --like IMG_4026 -o view.png", [](CLI::App& command) -> Action {
        auto options = std::make_shared<RenderArguments>();
        command.add_option("SET", options->request.set, "The set")->required();
        command
            .add_option("-o,--output", options->request.output,
                        "One frame: an image; several: a folder or an .mp4 file")
            ->required();
        auto* where = command.add_option_group("where", "Where to look from (exactly one)");
        where->add_option("--like", options->request.cameras.like, "From a view's position")
            ->type_name("VIEW");
        where
            ->add_option("--camera", options->request.cameras.camera_file,
                         "From the camera of a file, as --path")
            ->type_name("FILE");
        where
            ->add_option(
                "--path", options->request.cameras.path_file,
                "Along the cameras of a file: a cameras.json, or what dtr import --cameras reads")
            ->type_name("FILE");
        where
            ->add_option("--fly-through", options->request.cameras.fly_through_frames,
                         "Along the set's own cameras, N frames")
            ->check(CLI::Range(2, 100000))
            ->type_name("N");
        where->require_option(1);
        command
            .add_option("--size", options->request.cameras.size, "Size; 0 keeps the proportions")
            ->type_name("WxH");
        command
            .add_option("--frame", options->request.frame,
                        "Of a dynamic set: the frame to show, from 0 [a path runs through all]")
            ->check(CLI::Range(0, 1 << 30))
            ->type_name("N");
        command.add_flag("--play", options->request.play,
                         "Of a dynamic set: every frame in turn, from one position");
        command.add_option("--exclude", options->request.exclude, "Views not to render from")
            ->type_name("NAME,...");
        AddMeasuredOnly(command, options->request.measured_only);
        AddRendererOptions(command, options->renderer);
        AddMemoryOption(command, options->request.memory_gb,
                        "Memory for an image and the views' pixels; views beyond it are dropped "
                        "and read again [4]");
        command
            .add_option("--depth-out", options->request.depth_out, "Write the depth as float EXR")
            ->type_name("FILE");
        command
            .add_option("--coverage-out", options->request.coverage_out,
                        "Write what was seen as PNG")
            ->type_name("FILE");
        options->render = AddRenderOptions(command, WholeFrames());
        return [options, &command](const Context& context) {
          const DtrSet described = io::ReadSet(options->request.set);
          UseStoredOptions(command, described, *options->render);
          return RunRender(*options, described, context);
        };
      });
}

}  // namespace dtr::cli
