#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "cli/command.h"
#include "cli/output_file.h"
#include "cli/render_options.h"
#include "cli/renderers.h"
#include "dtr/base/error.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "dtr/io/video.h"
#include "dtr/render/scene.h"
#include "dtr/render/time_steps.h"
#include "dtr/render/view_stream.h"
#include "pipeline/detail/render/dynamic_scene.h"
#include "pipeline/detail/render/novel_frames.h"

namespace dtr::cli {
namespace {

namespace fs = std::filesystem;

struct RenderCommandArguments {
  fs::path set, output, depth_out, coverage_out;
  pipeline::NovelCameraRequest request;
  std::string exclude;
  std::optional<size_t> frame;  ///< of a dynamic set
  bool play = false;
  RendererChoice renderer;
  double memory_gb = 4;
  std::shared_ptr<RenderOptions> render;
};

// Writes frames where --output says: one image, a folder of images, or a video.
class FrameSink {
 public:
  FrameSink(const fs::path& output, bool several) : output_(output), several_(several) {
    if (output.extension() == ".mp4") {
      video_.emplace(output, io::kVideoFramesPerSecond);
    } else if (several) {
      fs::create_directories(output);
    }
  }
  std::string Add(const pipeline::NovelFrame& camera, const RenderResult& result, bool filled) {
    if (video_) {
      video_->Add(result.image);
      return output_.string();
    }
    const fs::path file = several_ ? output_ / (camera.name + ".png") : output_;
    // What no view saw is black with alpha 0, unless it was filled.
    if (filled || LowerExtension(file) != ".png") {
      io::WriteImage(file, result.image);
    } else {
      io::WriteImageWithAlpha(file, result.image, result.coverage);
    }
    return file.string();
  }
  void Finish(const Progress& progress) {
    if (video_) video_->Finish(progress);
  }

 private:
  fs::path output_;
  bool several_;
  std::optional<io::VideoWriter> video_;
};

// Everything about the outputs that can be known before the work.
void RequireOutputs(const RenderCommandArguments& options, bool several) {
  if (options.output.extension() == ".mp4") {
    RequireFolderOf(options.output, "-o");
  } else if (!several) {
    RequireOutputFile(options.output, "-o", {".png", ".jpg", ".jpeg"});
  } else if (!fs::is_directory(options.output) &&
             (!options.output.extension().empty() || fs::exists(options.output))) {
    throw UsageError(fmt::format("-o {}: several frames need a folder or an .mp4 file",
                                 options.output.string()));
  }
  if (several && (!options.depth_out.empty() || !options.coverage_out.empty())) {
    throw UsageError("--depth-out, --coverage-out: expected one camera with them, found several");
  }
  if (!options.depth_out.empty()) RequireOutputFile(options.depth_out, "--depth-out", {".exr"});
  if (!options.coverage_out.empty()) {
    RequireOutputFile(options.coverage_out, "--coverage-out", {".png"});
  }
}

void WritePlanes(const RenderCommandArguments& options, const RenderResult& result) {
  if (!options.depth_out.empty()) io::WriteExr(options.depth_out, result.depth.grid(), false);
  if (!options.coverage_out.empty()) io::WriteMask(options.coverage_out, result.coverage);
}

nlohmann::ordered_json FrameJson(const std::string& file, double ms, size_t shown,
                                 const RenderScene& scene, const RenderResult& result) {
  auto used = nlohmann::ordered_json::array();
  for (const int index : result.views_used) {
    used.push_back(scene.views[static_cast<size_t>(index)]->name);
  }
  return {{"file", file},
          {"ms", ms},
          {"frame", shown},
          {"views_used", used},
          {"coverage", result.coverage_share}};
}

// With --play, one camera sees every frame of the set.
std::vector<pipeline::NovelFrame> CamerasOf(const RenderCommandArguments& options,
                                            const DtrSet& set) {
  std::vector<pipeline::NovelFrame> cameras =
      pipeline::NovelFrames(AtFrame(set, options.frame.value_or(0)), options.request);
  if (!options.play) return cameras;
  if (cameras.size() != 1 || options.frame) {
    throw UsageError("--play: expected --like or --camera with it, and no --frame");
  }
  std::vector<pipeline::NovelFrame> all(set.frames.size(), cameras.front());
  for (size_t i = 0; i < all.size(); ++i) all[i].name = fmt::format("{:06}", i);
  return all;
}

// The frame of the set that image `i` shows; paths run through time.
size_t FrameShown(const RenderCommandArguments& options, const DtrSet& set, size_t i,
                  size_t pictures) {
  return options.frame ? *options.frame : FrameOfPicture(i, pictures, set.frames.size());
}

int RunRender(const RenderCommandArguments& options, const Context& context) {
  const DtrSet described = io::ReadSet(options.set);
  const auto cameras = CamerasOf(options, described);
  const bool several =
      options.play || !options.request.path_file.empty() || options.request.fly_through_frames > 0;
  RequireOutputs(options, several);
  RenderOptions render = *options.render;
  render.threads = context.common.threads;
  // Before anything is loaded: a machine without OpenGL should say so at once.
  const eval::RenderFunction render_view = MakeRenderer(options.renderer, context.console);
  pipeline::DynamicScene moving(options.set, described, options.exclude,
                                {options.memory_gb, render.threads}, context.console);
  moving.At(FrameShown(options, described, 0, cameras.size()));  // names are checked here

  FrameSink sink(options.output, several);
  nlohmann::ordered_json json{{"frames", nlohmann::ordered_json::array()}};
  context.console.Stage("rendering", static_cast<int>(cameras.size()));
  for (size_t i = 0; i < cameras.size(); ++i) {
    context.console.ThrowIfInterrupted();
    const size_t shown = FrameShown(options, described, i, cameras.size());
    ViewStream& stream = moving.At(shown);
    const RenderScene scene =
        stream.SceneFor(cameras[i].cam_from_world, render, ViewStream::Wait::kForAll);
    if (i + 1 < cameras.size() && FrameShown(options, described, i + 1, cameras.size()) == shown) {
      stream.Prefetch(cameras[i + 1].cam_from_world, render);
    }
    const auto start = std::chrono::steady_clock::now();
    const RenderResult result =
        render_view(scene, cameras[i].camera, cameras[i].cam_from_world, render);
    const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - start;
    if (result.views_used.empty()) {
      context.console.Note(
          fmt::format("WARNING: {}: no view is valid for this camera: the image "
                      "is empty",
                      cameras[i].name));
    }
    const std::string file = sink.Add(cameras[i], result, render.fill_holes);
    WritePlanes(options, result);
    json["frames"].push_back(FrameJson(file, ms.count(), shown, scene, result));
    context.console.Update(static_cast<int>(i) + 1);
  }
  sink.Finish(context.console);
  context.console.Say(
      fmt::format("{}: {} frame{}", options.output.string(), cameras.size(), several ? "s" : ""));
  json["skipped"] = nlohmann::ordered_json::array();
  for (const ViewStream::Lost& lost : moving.lost()) {
    json["skipped"].push_back({{"name", lost.name}, {"reason", lost.reason}});
  }
  context.EmitJson(json.dump(1));
  return kDone;
}

}  // namespace

void AddRenderCommand(CLI::App& app) {
  AddCommand(
      app, "render", "Render new views of a set",
      "dtr render scene.dtr --like IMG_4026 -o view.png", [](CLI::App& command) -> Action {
        auto options = std::make_shared<RenderCommandArguments>();
        command.add_option("SET", options->set, "The set")->required();
        command
            .add_option("-o,--output", options->output,
                        "One frame: an image; several: a folder or an .mp4 file")
            ->required();
        auto* where = command.add_option_group("where", "Where to look from (exactly one)");
        where->add_option("--like", options->request.like, "From a view's position")
            ->type_name("VIEW");
        where->add_option("--camera", options->request.camera_file, "From a cameras.json")
            ->type_name("FILE");
        where->add_option("--path", options->request.path_file, "Along a cameras.json")
            ->type_name("FILE");
        where
            ->add_option("--fly-through", options->request.fly_through_frames,
                         "Along the set's own cameras, N frames")
            ->check(CLI::Range(2, 100000))
            ->type_name("N");
        where->require_option(1);
        command.add_option("--size", options->request.size, "Size; 0 keeps the proportions")
            ->type_name("WxH");
        command
            .add_option("--frame", options->frame,
                        "Of a dynamic set: the frame to show, from 0 [a path runs through all]")
            ->check(CLI::Range(0, 1 << 30))
            ->type_name("N");
        command.add_flag("--play", options->play,
                         "Of a dynamic set: every frame in turn, from one position");
        command.add_option("--exclude", options->exclude, "Views not to render from")
            ->type_name("NAME,...");
        AddRendererOptions(command, options->renderer);
        AddMemoryOption(command, options->memory_gb,
                        "Memory for the views' pixels; others are dropped and read again [4]");
        command.add_option("--depth-out", options->depth_out, "Write the depth as float EXR")
            ->type_name("FILE");
        command.add_option("--coverage-out", options->coverage_out, "Write what was seen as PNG")
            ->type_name("FILE");
        options->render = AddRenderOptions(command);
        return [options, &command](const Context& context) {
          UseStoredArguments(command, io::ReadSet(options->set), *options->render);
          return RunRender(*options, context);
        };
      });
}

}  // namespace dtr::cli
