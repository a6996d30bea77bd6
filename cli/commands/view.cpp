#include <fmt/format.h>
#include <malloc.h>
#include <sys/stat.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "cli/command.h"
#include "cli/output_file.h"
#include "cli/prompt_end.h"
#include "cli/render_arguments.h"
#include "cli/render_options.h"
#include "cli/renderers.h"
#include "cli/shell_words.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/machine.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/set_io.h"
#include "dtr/io/validation_result.h"
#include "dtr/render/frame_memory.h"
#include "dtr/render/time_steps.h"
#include "pipeline/core/set_stream.h"
#include "pipeline/core/view_names.h"
#include "pipeline/render/novel_frames.h"
#include "pipeline/validate/validate.h"
#include "viewer/frame_rate_controller.h"
#include "viewer/glfw/app.h"

namespace dtr::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Options {
  fs::path set, output = ".", screenshot, state_file;
  pipeline::NovelCameraRequest request;
  std::string size = "1280x800", exclude;
  RendererChoice renderer;
  double memory_gb = 4;
  int frames = 0, laps = 1, largest_divisor = 4;
  size_t time_step = 0;
  bool play = false, no_panel = false, cameras = false, photo = false, measured_only = false;
  std::shared_ptr<RenderOptions> render;
};

/// A set that the window shows; the console outlives it.
std::unique_ptr<viewer::OpenedSet> Open(const Options& options, const Context& context) {
  auto opened = std::make_unique<viewer::OpenedSet>();
  opened->set = io::ReadSet(options.set);
  opened->defaults = StoredRenderOptions(opened->set, WholeFrames());
  io::CollapseDuplicates(opened->set);
  opened->stream = pipeline::StreamOf(options.set, opened->set, DescribeFrames(opened->set, {}),
                                      {options.memory_gb, options.measured_only}, context.console);
  return opened;
}

/// Beside the camera's file: "FILE.png", "FILE-depth.exr".
std::string Beside(const fs::path& camera_file, const char* ending) {
  return (fs::path(camera_file).parent_path() / camera_file.stem()).string() + ending;
}

/// All of the library's and the set's own defaults is left to `dtr render`, which has them, too.
std::string CommandLine(const Options& options, const viewer::OpenedSet& opened,
                        const viewer::ToDraw& wanted) {
  const fs::path camera_file = fs::absolute(wanted.camera_file);
  std::vector<std::string> words{"dtr",
                                 "render",
                                 fs::absolute(options.set).string(),
                                 "--camera",
                                 camera_file.string(),
                                 "-o",
                                 Beside(camera_file, ".png")};
  if (wanted.depth) words.insert(words.end(), {"--depth-out", Beside(camera_file, "-depth.exr")});
  if (wanted.coverage) {
    words.insert(words.end(), {"--coverage-out", Beside(camera_file, "-coverage.png")});
  }
  if (wanted.time_step) words.insert(words.end(), {"--frame", std::to_string(*wanted.time_step)});
  std::string excluded;
  for (const View* view : wanted.hidden) {
    // A comma would end the name; ids have none.
    const bool plain = view->name.find(',') == std::string::npos;
    excluded += (excluded.empty() ? "" : ",") + (plain ? view->name : view->id);
  }
  if (options.measured_only) words.push_back("--measured-only");
  if (!excluded.empty()) words.insert(words.end(), {"--exclude", excluded});
  const auto further = RenderOptionArguments(wanted.options, opened.defaults);
  words.insert(words.end(), further.begin(), further.end());
  // Where memory holds fewer views than an image asks for, it is another image.
  const Options defaults;
  if (options.memory_gb != defaults.memory_gb) {
    words.insert(words.end(), {"--memory", fmt::format("{}", options.memory_gb)});
  }
  if (options.renderer.gpu_memory_gb != defaults.renderer.gpu_memory_gb) {
    words.insert(words.end(), {"--gpu-memory", fmt::format("{}", options.renderer.gpu_memory_gb)});
  }
  return ShellLine(words);
}

Json ControlsJson(const std::vector<viewer::ControlPlace>& controls) {
  Json json = Json::array();
  for (const viewer::ControlPlace& one : controls) {
    json.push_back({{"name", one.name},
                    {"x", one.x},
                    {"y", one.y},
                    {"width", one.width},
                    {"height", one.height},
                    {"visible", one.visible}});
  }
  return json;
}

Json StateJson(const viewer::AppState& state) {
  const PinholeCamera& lens = state.camera.camera;
  const Eigen::Quaterniond& q = state.camera.cam_from_world.rotation;
  const Eigen::Vector3d center = state.camera.cam_from_world.TargetOriginInSource();
  return {{"still", state.still},
          {"at_view", state.at_view},
          {"at_held_out", state.at_held_out},
          {"photo", state.photo},
          {"thumbnails", state.thumbnails},
          {"shown", state.shown},
          {"divisor", state.divisor},
          {"width_px", lens.width_px()},
          {"height_px", lens.height_px()},
          {"fx_px", lens.fx_px()},
          {"fy_px", lens.fy_px()},
          {"cam_from_world_wxyz", {q.w(), q.x(), q.y(), q.z()}},
          {"center_in_world", {center.x(), center.y(), center.z()}},
          {"views_used", state.views_used},
          {"coverage", state.coverage},
          {"fly_speed", state.fly_speed},
          {"help", state.help},
          {"panel", state.panel},
          {"cameras", state.cameras},
          {"magnifier", state.magnifier},
          {"compared", state.compared},
          {"hidden", state.hidden},
          {"under_cursor", state.under_cursor},
          {"distance", state.distance},
          {"path_keys", state.path_keys},
          {"frames_per_key", state.frames_per_key},
          {"recording", state.recording},
          {"asks_for_path", state.asks_for_path},
          {"reloads", state.reloads},
          {"time_step", state.time_step},
          {"time_steps", state.time_steps},
          {"playing_time", state.playing_time},
          {"time_speed", state.time_speed},
          {"loops_time", state.loops_time},
          {"controls", ControlsJson(state.controls)},
          {"message", state.message},
          {"render_options", RenderOptionArguments(state.render, WholeFrames())}};
}

Json TimesJson(const viewer::FrameTimes& times) {
  const int n = times.frames;
  const auto per_frame = [n](double ms) { return n > 0 ? Json(ms / n) : Json(); };
  return {{"frames", n},
          {"ms", per_frame(times.ms)},
          {"cpu_ms", per_frame(times.cpu_ms)},
          {"fps", n > 0 ? Json(1e3 * n / times.ms) : Json()}};
}

Json ReportJson(const viewer::AppReport& report) {
  Json moving = TimesJson(report.moving);
  moving["largest_divisor"] =
      report.moving_by_divisor.empty() ? 1 : report.moving_by_divisor.rbegin()->first;
  moving["by_divisor"] = Json::array();
  for (const auto& [divisor, times] : report.moving_by_divisor) {
    Json one = TimesJson(times);
    one["divisor"] = divisor;
    moving["by_divisor"].push_back(one);
  }
  return {{"frames", report.last.frames},
          {"first_frame_ms", report.first_frame_ms},
          {"first_frame_cpu_ms", report.first_frame_cpu_ms},
          {"first_whole_frame_ms", report.first_whole_frame_ms},
          {"first_whole_frame_cpu_ms", report.first_whole_frame_cpu_ms},
          {"moving", moving},
          {"view_bytes", report.view_bytes},
          {"view_bytes_held", report.view_bytes_held},
          {"peak_rss_bytes", PeakMemoryBytes()},
          {"frames_per_sample", viewer::AppReport::kFramesPerSample},
          {"rss_bytes", report.memory_bytes},
          {"last", StateJson(report.last)}};
}

/// Each camera's held-out error against the limit for the worst one.
std::map<std::string, viewer::ViewValidation> ValidateViews(const Options& options) {
  const DtrSet set = io::ReadSet(options.set);
  std::map<std::string, viewer::ViewValidation> validations;
  if (!set.sparse_file) return validations;  // nothing to validate by
  const calib::ValidateLimits limits;
  const auto report = pipeline::ReprojectionOfSet(set, io::LoadSparse(options.set, set), limits);
  for (const auto& camera : report.cameras) {
    if (camera.held_out.count < limits.min_observations) continue;
    validations[camera.name] = {camera.held_out.rms_px <= limits.max_camera_rms_px,
                                fmt::format("{:.2f} px", camera.held_out.rms_px)};
  }
  return validations;
}

/// Not of its bytes: nothing is read for it. Empty where there is no such file.
std::string FileStamp(const fs::path& file) {
  struct stat found {};
  if (stat(file.c_str(), &found) != 0) return "";
  return fmt::format("{} {} {}.{}", found.st_ino, found.st_size, found.st_mtim.tv_sec,
                     found.st_mtim.tv_nsec);
}

/// Of the files that images are made of; empty while one is missing.
std::string ViewStampOf(const fs::path& set, const View& view) {
  std::string stamp;
  for (const auto* file : {&view.image_file, &view.mask_file, &view.depth_file, &view.depth_base,
                           &view.completed_file, &view.completed_base}) {
    if (!file->has_value()) continue;
    const std::string one = FileStamp(set / (*file)->path);
    if (one.empty()) return "";
    stamp += one + ";";
  }
  return stamp;
}

std::vector<NovelCamera> CamerasOf(const std::vector<pipeline::NovelFrame>& frames) {
  std::vector<NovelCamera> cameras;
  for (const pipeline::NovelFrame& frame : frames)
    cameras.push_back({frame.camera, frame.cam_from_world});
  return cameras;
}

viewer::Host MakeHost(const Options& options, const Context& context, PromptEnd& end) {
  viewer::Host host;
  host.stop_requested = [&] { return context.console.StopRequested(); };
  host.writing = [&](bool begins) { end.Hold(begins); };
  host.open = [&] { return Open(options, context); };
  host.stamp = [&] { return FileStamp(options.set / "set.json"); };  // written last
  host.view_stamp = [&](const View& view) { return ViewStampOf(options.set, view); };
  host.read_path = [](const DtrSet& set, const fs::path& file) {
    pipeline::NovelCameraRequest request;
    request.path_file = file;
    return CamerasOf(pipeline::NovelFrames(AtFrame(set, 0), request));
  };
  host.load_sigma = [&](const View& view) {
    View with_sigma = view;
    io::LoadOptions load;
    load.images = load.depth = false;
    load.sigma = true;
    io::LoadPixels(options.set, with_sigma, load);
    return with_sigma.inverse_depth_sigma.value_or(Grid<float>());
  };
  host.load_photo = [&](const View& view) {
    View with_photo = view;
    io::LoadOptions load;
    load.depth = false;
    io::LoadPixels(options.set, with_photo, load);
    return std::move(with_photo.image);
  };
  host.command_line = [&](const viewer::OpenedSet& opened, const viewer::ToDraw& wanted) {
    return CommandLine(options, opened, wanted);
  };
  host.validations = [&] {
    const ThreadLimit limit(context.common.threads);  // it runs on a thread of its own
    return ValidateViews(options);
  };
  host.say = [&](const std::string& line) { context.console.Note(line); };
  if (!options.state_file.empty()) {
    host.state_changed = [&, last = std::string()](const viewer::AppState& state) mutable {
      const std::string text = StateJson(state).dump(1, ' ', false, Json::error_handler_t::replace);
      if (text == last) return;
      WriteFileAtomically(options.state_file, text + "\n");
      last = text;
    };
  }
  return host;
}

gl::Drawer DrawerOf(const std::string& renderer) {
  if (renderer == "gl") return gl::Drawer::kOpenGl;
  return renderer == "simd" ? gl::Drawer::kSimd : gl::Drawer::kFitting;
}

viewer::AppSettings SettingsOf(const Options& options, const DtrSet& set) {
  viewer::AppSettings settings;
  settings.hidden = pipeline::ResolveViewNames(AtFrame(set, options.time_step), options.exclude);
  const PinholeCamera size = pipeline::WithSize({1280, 800, 1, 1, 0, 0}, options.size);
  RequireFrameMemory(size, false, options.memory_gb, "window");
  settings.warning = io::ValidationWarning(set);
  settings.title = WithoutTrailingSlash(options.set).filename().string() + " - dtr view";
  if (!settings.warning.empty()) settings.title += " - " + settings.warning;
  settings.width_px = size.width_px();
  settings.height_px = size.height_px();
  settings.render = *options.render;
  settings.gpu_bytes = static_cast<size_t>(options.renderer.gpu_memory_gb * kBytesPerGigabyte);
  settings.shader_folder = options.renderer.shader_folder.string();
  settings.drawer = DrawerOf(options.renderer.name);
  settings.output = options.output;
  settings.output_stem = WithoutTrailingSlash(options.set).stem().string();
  settings.panel = !options.no_panel;
  settings.cameras = options.cameras;
  settings.photo = options.photo;
  settings.frames = options.frames;
  settings.time_step = options.time_step;
  settings.play_time = options.play;
  settings.laps = options.laps;
  settings.largest_divisor = options.largest_divisor;
  settings.screenshot = options.screenshot;
  pipeline::NovelCameraRequest request = options.request;
  request.load_depth = pipeline::DepthLoaderOf(options.set);
  if (request.like.empty() && request.camera_file.empty() && request.path_file.empty() &&
      request.fly_through_frames == 0) {
    return settings;
  }
  const std::vector<pipeline::NovelFrame> frames =
      pipeline::NovelFrames(AtFrame(set, options.time_step), request);
  settings.start = NovelCamera{frames.front().camera, frames.front().cam_from_world};
  if (frames.size() > 1) settings.play = CamerasOf(frames);
  return settings;
}

/// Views come and go for as long as the window is open: what glibc keeps of the big blocks that
/// were freed, in as many arenas as there are threads, is memory that others cannot have.
void LimitKeptMemory() {
#ifdef __GLIBC__
  constexpr int kBlockBytes = 256 << 10;
  mallopt(M_MMAP_THRESHOLD, kBlockBytes);
  mallopt(M_TRIM_THRESHOLD, kBlockBytes);
  mallopt(M_ARENA_MAX, 2);
#endif
}

int RunView(const Options& options, const Context& context, PromptEnd& end) {
  if (!options.screenshot.empty()) {
    RequireOutputFile(options.screenshot, "--screenshot", {".png", ".jpg", ".jpeg"});
    if (options.frames == 0) throw UsageError("--screenshot: expected --frames N with it");
  }
  if (!fs::is_directory(options.output)) {
    throw UsageError("-o " + options.output.string() +
                     ": expected a folder to save into, found none");
  }
  LimitKeptMemory();
  const DtrSet set = io::ReadSet(options.set);
  const std::string warning = io::ValidationWarning(set);
  if (!warning.empty()) context.console.Note(warning);
  const viewer::AppReport report =
      viewer::RunViewer(SettingsOf(options, set), MakeHost(options, context, end));
  context.console.ThrowIfInterrupted();
  context.EmitJson(ReportJson(report).dump(1, ' ', false, Json::error_handler_t::replace));
  return kDone;
}

}  // namespace

void AddViewCommand(CLI::App& app) {
  AddCommand(
      app, "view", "Look at a set in a window; ? lists the keys", "dtr view scene.dtr",
      [](CLI::App& command) -> Action {
        auto options = std::make_shared<Options>();
        command.add_option("SET", options->set, "The set")->required();
        command
            .add_option("-o,--output", options->output,
                        "Folder for images, cameras and paths that are saved [.]")
            ->type_name("DIR");
        auto* where = command.add_option_group("where", "Where to start (at most one)");
        where->add_option("--like", options->request.like, "At a view's position")
            ->type_name("VIEW");
        where->add_option("--camera", options->request.camera_file, "At a cameras.json's camera")
            ->type_name("FILE");
        where->add_option("--path", options->request.path_file, "Fly along a cameras.json first")
            ->type_name("FILE");
        where
            ->add_option("--fly-through", options->request.fly_through_frames,
                         "Fly along the set's own cameras first, N frames")
            ->check(CLI::Range(2, 100000))
            ->type_name("N");
        where->require_option(0, 1);
        command.add_option("--laps", options->laps, "How often to fly along the path [1]")
            ->check(CLI::Range(1, 1'000'000))
            ->type_name("N");
        command
            .add_option("--frame", options->time_step,
                        "Of a dynamic set: the frame shown first, from 0 [0]")
            ->check(CLI::Range(0, 1 << 30))
            ->type_name("N");
        command.add_flag("--play", options->play, "Of a dynamic set: play it at once");
        command
            .add_option("--largest-divisor", options->largest_divisor,
                        "While the camera moves, divide the image's sides by no more than N [4]")
            ->check(CLI::Range(1, viewer::ResolutionFrameRateController::kMaxDivisor))
            ->type_name("N");
        command.add_option("--size", options->size, "Size of the window [1280x800]")
            ->type_name("WxH");
        command.add_option("--exclude", options->exclude, "Views not to render from")
            ->type_name("NAME,...");
        command
            .add_option("--frames", options->frames,
                        "Close after N frames, once the image is whole; for scripts")
            ->check(CLI::Range(1, 100'000'000))
            ->type_name("N");
        command
            .add_option("--screenshot", options->screenshot,
                        "Save the window before it closes by --frames")
            ->type_name("FILE");
        command.add_flag("--no-panel", options->no_panel, "Begin without the panel");
        command.add_flag("--cameras", options->cameras, "Begin with the input cameras shown");
        command.add_flag("--photo", options->photo,
                         "Begin with the nearest photo beside the image");
        command
            .add_option("--state-file", options->state_file,
                        "Keep FILE telling, as JSON, what the window shows; for scripts")
            ->type_name("FILE");
        AddWindowRendererOptions(command, options->renderer);
        AddMeasuredOnly(command, options->measured_only);
        AddMemoryOption(command, options->memory_gb,
                        "Memory for the image and the views' pixels; views beyond it are dropped "
                        "and read again [4]");
        options->render = AddRenderOptions(command, WholeFrames());
        return [options, &command](const Context& context) {
          PromptEnd end(context.console);
          UseStoredOptions(command, io::ReadSet(options->set), *options->render);
          return RunView(*options, context, end);
        };
      });
}

}  // namespace dtr::cli
