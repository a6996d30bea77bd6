#include "pipeline/export/export.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "cli/command.h"
#include "cli/output_file.h"
#include "cli/render_options.h"
#include "cli/renderers.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/lower_case.h"
#include "dtr/io/set_io.h"
#include "pipeline/export/export_web.h"
#include "pipeline/prune/prune.h"

namespace dtr::cli {
namespace {

using Request = pipeline::ExportRequest;
using Names = std::vector<std::string>;

struct Format {
  const char* name;
  pipeline::ExportReport (*write)(const Request& request, Progress& progress);
  Names extensions;    ///< of the file; empty: a folder
  const char* points;  ///< what ExportReport::points counts
};

// All but `web`, which has a request and a report of its own.
const std::vector<Format>& Formats() {
  static const std::vector<Format> formats = {
      {"colmap", pipeline::ExportColmap, {}, "points"},
      {"ply", pipeline::ExportPly, {".ply"}, "points"},
      {"las", pipeline::ExportLas, {".las"}, "points"},
      {"mesh", pipeline::ExportMesh, {".ply", ".glb"}, "vertices"},
      {"splat", pipeline::ExportSplat, {".ply", ".splat", ".glb"}, "gaussians"},
      {"depth", pipeline::ExportDepth, {}, nullptr},
      {"nerfstudio", pipeline::ExportNerfstudio, {}, "points"},
      {"mvsnet", pipeline::ExportMvsnet, {}, nullptr},
      {"openmvs", pipeline::ExportOpenmvs, {}, "points"},
      {"miv", pipeline::ExportMiv, {}, nullptr},
  };
  return formats;
}

Names FormatNames() {
  Names names;
  for (const Format& format : Formats()) names.emplace_back(format.name);
  names.emplace_back("web");
  return names;
}

// An option that some formats take.
struct FormatOption {
  const CLI::Option* option;
  Names formats;
};

const Names kWebEndings = {".html", ".htm"};

// The first format that writes files of this ending; empty: none.
std::string FormatOfEnding(const std::string& ending) {
  const auto has = [&](const Names& endings) {
    return std::find(endings.begin(), endings.end(), ending) != endings.end();
  };
  for (const Format& format : Formats()) {
    if (has(format.extensions)) return format.name;
  }
  return has(kWebEndings) ? "web" : "";
}

// Without --format the name's ending decides.
std::string FormatFor(const std::filesystem::path& output) {
  const std::string ending = LowerExtension(WithoutTrailingSlash(output));
  if (ending.empty()) return "colmap";
  const std::string format = FormatOfEnding(ending);
  if (!format.empty()) return format;
  throw UsageError(fmt::format(
      "-o {}: no format writes files that end in '{}', found no --format either; end the name in "
      ".ply, .las, .glb, .splat or .html, or give --format",
      output.string(), ending));
}

// A folder called like a file would be taken for one.
void RequireFolderName(const std::filesystem::path& output, const char* format) {
  const std::string ending = LowerExtension(output);
  const std::string of_files = FormatOfEnding(ending);
  if (of_files.empty()) return;
  throw UsageError(fmt::format(
      "-o {}: --format {} writes a folder, and '{}' is the ending of a file, as --format {} "
      "writes; choose another name or format",
      output.string(), format, ending, of_files));
}

struct ExportOptions {
  std::string format;  ///< empty: by the name's ending
  Request request;
  pipeline::WebPageRequest web;
  bool evaluates_web = true;
  std::vector<FormatOption> of_formats;
};

void RequireOptionsOfFormat(const ExportOptions& options) {
  for (const auto& [option, formats] : options.of_formats) {
    if (option->count() == 0 ||
        std::find(formats.begin(), formats.end(), options.format) != formats.end()) {
      continue;
    }
    throw UsageError(fmt::format("{} needs --format {}, found --format {}; leave one of them out",
                                 option->get_name(), fmt::join(formats, " or "), options.format));
  }
}

std::string Summary(const Request& request, const Format& format,
                    const pipeline::ExportReport& report) {
  Names parts = {fmt::format("{} images", report.images)};
  if (report.depth_maps > 0) parts.push_back(fmt::format("{} depth maps", report.depth_maps));
  if (format.points != nullptr) parts.push_back(fmt::format("{} {}", report.points, format.points));
  if (report.triangles > 0) parts.push_back(fmt::format("{} triangles", report.triangles));
  return fmt::format("{}: {}{}", request.output.string(), fmt::join(parts, ", "),
                     report.points_from_depth ? " from depth, as the set has no sparse ones" : "");
}

int RunFormat(Request request, const Format& format, const Context& context) {
  request.output = WithoutTrailingSlash(request.output);
  if (format.extensions.empty()) {
    RequireFolderName(request.output, format.name);
  } else {
    RequireOutputFile(request.output, "-o", format.extensions);
  }
  if (!std::filesystem::exists(request.output)) RequireFolderOf(request.output, "-o");
  request.force = context.common.force;
  const pipeline::ExportReport report = format.write(request, context.console);
  context.console.Say(Summary(request, format, report));
  nlohmann::ordered_json json{{"format", format.name}, {"images", report.images}};
  if (report.triangles > 0) json["triangles"] = report.triangles;
  if (report.depth_maps > 0) json["depth_maps"] = report.depth_maps;
  if (format.points != nullptr) json[format.points] = report.points;
  if (format.write == pipeline::ExportColmap) {
    json["points_from"] = report.points_from_depth ? "depth" : "sparse";
  }
  context.EmitJson(json, -1);
  return kDone;
}

int RunWeb(pipeline::WebPageRequest request, const Context& context) {
  request.as_site = !request.output.has_filename() || !request.output.has_extension();
  request.output = WithoutTrailingSlash(request.output);
  if (request.as_site) {
    RequireFolderOf(request.output, "-o");
  } else {
    RequireOutputFile(request.output, "-o", kWebEndings);
  }
  request.force = context.common.force;
  const pipeline::WebPageReport report = pipeline::ExportWebPage(request, context.console);
  if (!report.warning.empty()) context.console.Note(report.warning);
  const std::string photos = report.jpeg_quality > 0
                                 ? fmt::format("photos of JPEG quality {}", report.jpeg_quality)
                                 : "photos as in the set";
  const std::string pruned =
      report.pruned_db > 0 ? fmt::format(", pruned for at most {} dB", report.pruned_db) : "";
  context.console.Say(fmt::format("{}: {} views, {:.2f} MB, {}, depth within {} px of disparity{}",
                                  request.output.string(), report.views,
                                  static_cast<double>(report.bytes) / 1e6, photos,
                                  report.depth_error_px, pruned));
  const nlohmann::ordered_json json = {{"views", report.views},
                                       {"bytes", report.bytes},
                                       {"jpeg_quality", report.jpeg_quality},
                                       {"depth_error_px", report.depth_error_px},
                                       {"pruned_db", report.pruned_db}};
  context.EmitJson(json, -1);
  return kDone;
}

// For pages that are too large.
std::function<void(double loss_db, const std::filesystem::path& output)> PruneOf(
    const pipeline::WebPageRequest& web, const Context& context) {
  return [&web, &context](double loss_db, const std::filesystem::path& output) {
    pipeline::PruneSetOptions prune;
    prune.set = web.set;
    prune.output = output;
    prune.prune.max_loss_db = loss_db;
    prune.prune.render = web.render;
    prune.make_renderer = web.make_renderer;
    prune.make_timed_renderer = [&context] { return MakeTimedRenderer({}, context.console); };
    PruneSet(prune, context.console);
  };
}

int RunExport(ExportOptions options, const Context& context) {
  if (options.format.empty()) options.format = FormatFor(options.request.output);
  RequireOptionsOfFormat(options);
  if (options.format == "web") {
    options.web.set = options.request.set;
    options.web.output = options.request.output;
    if (options.evaluates_web) {
      options.web.render = StoredRenderOptions(io::ReadSet(options.web.set), WholeFrames());
      options.web.make_renderer = [&context] { return MakeRenderer({}, context.console); };
      if constexpr (DTR_WITH_PRUNE) options.web.prune = PruneOf(options.web, context);
    }
    return RunWeb(options.web, context);
  }
  const auto format = std::find_if(Formats().begin(), Formats().end(), [&](const Format& known) {
    return known.name == options.format;
  });
  return RunFormat(options.request, *format, context);
}

void AddCloudOptions(CLI::App& command, ExportOptions& options) {
  Request& request = options.request;
  options.of_formats.push_back(
      {command.add_flag("--completed", request.completed,
                        "With completed depth, not only what was measured"),
       {"ply", "las", "mesh", "depth", "nerfstudio", "mvsnet", "openmvs", "miv"}});
  options.of_formats.push_back(
      {command
           .add_option("--min-views", request.min_views,
                       "ply, las, mesh: views that must show a point at the same depth [2]")
           ->check(CLI::Range(1, 100))
           ->type_name("N"),
       {"ply", "las", "mesh"}});
  options.of_formats.push_back(
      {command
           .add_option("--voxel", request.voxel,
                       "mesh: width of a voxel in scene units [twice a pixel's on the surface]")
           ->check(CLI::PositiveNumber)
           ->type_name("SIZE"),
       {"mesh"}});
  AddMemoryOption(command, request.memory_gb, "Memory for depth maps that are held at a time [4]");
}

// An option whose value is one of some names.
template <typename T>
CLI::Option* AddChoice(CLI::App& command, const std::string& name, T& value,
                       const std::map<std::string, T>& values, const std::string& description) {
  Names names;
  for (const auto& [text, unused] : values) names.push_back(text);
  return command
      .add_option_function<std::string>(
          name, [&value, values](const std::string& text) { value = values.at(text); }, description)
      ->check(CLI::IsMember(names))
      ->type_name(fmt::format("{}", fmt::join(names, "|")));
}

void AddDepthOptions(CLI::App& command, ExportOptions& options) {
  using FileFormat = pipeline::DepthFileFormat;
  Request& request = options.request;
  const Names depth = {"depth"};
  options.of_formats.push_back({AddChoice(command, "--depth-format", request.depth_format,
                                          {{"exr", FileFormat::kExr},
                                           {"pfm", FileFormat::kPfm},
                                           {"png16", FileFormat::kPng16},
                                           {"npy", FileFormat::kNpy}},
                                          "depth: files of depth [exr]"),
                                depth});
  options.of_formats.push_back(
      {AddChoice(command, "--depth-kind", request.depth_kind,
                 {{"z", DepthKind::kPlaneZ}, {"ray", DepthKind::kRayDistance}},
                 "depth: z in the camera frame or distance from the camera [z]"),
       depth});
  options.of_formats.push_back(
      {AddChoice(
           command, "--grid", request.depth_grid,
           {{"set", pipeline::DepthGrid::kSet}, {"photo", pipeline::DepthGrid::kPhoto}},
           "depth: at the pixels of the set's undistorted images or of the original photos [set]"),
       depth});
}

void AddSplatOptions(CLI::App& command, ExportOptions& options) {
  Request& request = options.request;
  options.of_formats.push_back(
      {command.add_option("--max-count", request.max_count, "splat: Gaussians at most [no bound]")
           ->check(CLI::Range(1, 2000000000))
           ->type_name("N"),
       {"splat"}});
  options.of_formats.push_back(
      {command.add_flag("--full-sh", request.full_sh,
                        "splat: write the coefficients of degrees 1 to 3 too (all 0), which the "
                        "original viewer wants"),
       {"splat"}});
}

void AddWebOptions(CLI::App& command, ExportOptions& options) {
  options.of_formats.push_back(
      {command
           .add_option("--max-mb", options.web.max_mb,
                       "web: at most N MB (10^6 bytes); photos and depth are coded more coarsely, "
                       "and what images need least is left out, until the page fits")
           ->check(CLI::PositiveNumber)
           ->type_name("N"),
       {"web"}});
  options.of_formats.push_back(
      {command
           .add_option("--jpeg-quality", options.web.jpeg_quality,
                       "web: of the photos [85, or the JPEG that the set stores]")
           ->check(CLI::Range(1, 100))
           ->type_name("Q"),
       {"web"}});
  options.of_formats.push_back(
      {command
           .add_option("--depth-error", options.web.depth_error_px,
                       "web: depth is rounded to within PX pixels of disparity [0.15]")
           ->check(CLI::Range(0.001, 10.0))
           ->type_name("PX"),
       {"web"}});
  options.of_formats.push_back(
      {command.add_flag("!--no-evaluate", options.evaluates_web,
                        "web: without figures of held-out photos, which take as long as dtr "
                        "evaluate, and leave nothing out for --max-mb"),
       {"web"}});
}

}  // namespace

void AddExportCommand(CLI::App& app) {
  AddCommand(
      app, "export", "Write a set as a web page, cameras, depth maps, a cloud, a mesh, splats",
      "dtr export scene.dtr --format web -o scene.html", [](CLI::App& command) -> Action {
        auto options = std::make_shared<ExportOptions>();
        command.add_option("SET", options->request.set, "The set")->required();
        command
            .add_option("--format", options->format,
                        "What to write, see docs/EXPORT.md; web is one HTML file, or a folder for "
                        "a web server, that shows the scene in a browser [by the ending of -o: "
                        ".ply ply, .las las, .glb mesh, .splat splat, .html web, none colmap]")
            ->check(CLI::IsMember(FormatNames()))
            ->type_name(fmt::format("{}", fmt::join(FormatNames(), "|")));
        options->of_formats.push_back(
            {command.add_flag("--text", options->request.text,
                              "colmap: COLMAP's text files instead of binary"),
             {"colmap"}});
        AddCloudOptions(command, *options);
        AddSplatOptions(command, *options);
        AddDepthOptions(command, *options);
        AddWebOptions(command, *options);
        command.add_option("-o,--output", options->request.output, "Folder or file to write")
            ->required()
            ->type_name("PATH");
        return [options](const Context& context) { return RunExport(*options, context); };
      });
}

}  // namespace dtr::cli
