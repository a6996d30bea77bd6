#include "pipeline/export.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>

#include "cli/command.h"
#include "cli/number_checks.h"
#include "cli/output_file.h"
#include "dtr/base/files.h"

namespace dtr::cli {
namespace {

using Request = pipeline::ExportRequest;

struct Format {
  const char* name;
  pipeline::ExportReport (*write)(const Request& request, Progress& progress);
  std::vector<std::string> extensions;  ///< of the file; empty: a folder
  const char* points;                   ///< what ExportReport::points counts
};

const std::vector<Format>& Formats() {
  static const std::vector<Format> formats = {
      {"colmap", pipeline::ExportColmap, {}, "points"},
      {"ply", pipeline::ExportPly, {".ply"}, "points"},
      {"splat", pipeline::ExportSplat, {".ply", ".splat"}, "gaussians"},
      {"depth", pipeline::ExportDepth, {}, nullptr},
      {"nerfstudio", pipeline::ExportNerfstudio, {}, "points"},
      {"mvsnet", pipeline::ExportMvsnet, {}, nullptr},
  };
  return formats;
}

const Format& FormatCalled(const std::string& name) {
  return *std::find_if(Formats().begin(), Formats().end(),
                       [&](const Format& format) { return format.name == name; });
}

std::string Summary(const Request& request, const Format& format,
                    const pipeline::ExportReport& report) {
  std::vector<std::string> parts = {fmt::format("{} images", report.images)};
  if (report.depth_maps > 0) parts.push_back(fmt::format("{} depth maps", report.depth_maps));
  if (format.points != nullptr) parts.push_back(fmt::format("{} {}", report.points, format.points));
  return fmt::format("{}: {}{}", request.output.string(), fmt::join(parts, ", "),
                     report.points_from_depth ? " from depth, as the set has no sparse ones" : "");
}

int RunExport(Request request, const std::string& format_name, const Context& context) {
  const Format& format = FormatCalled(format_name);
  request.output = WithoutTrailingSlash(request.output);
  if (!format.extensions.empty()) RequireOutputFile(request.output, "-o", format.extensions);
  if (!std::filesystem::exists(request.output)) RequireFolderOf(request.output, "-o");
  request.threads = context.common.threads;
  const pipeline::ExportReport report = format.write(request, context.console);
  context.console.Say(Summary(request, format, report));
  nlohmann::ordered_json json{{"format", format.name}, {"images", report.images}};
  if (report.depth_maps > 0) json["depth_maps"] = report.depth_maps;
  if (format.points != nullptr) json[format.points] = report.points;
  if (format_name == "colmap") json["points_from"] = report.points_from_depth ? "depth" : "sparse";
  context.EmitJson(json, -1);
  return kDone;
}

void AddCloudOptions(CLI::App& command, Request& request) {
  command.add_flag("--completed", request.completed,
                   "With completed depth, not only what was measured");
  command
      .add_option("--min-views", request.min_views,
                  "ply: views that must show a point at the same depth [2]")
      ->check(CLI::Range(1, 100))
      ->type_name("N");
  AddMemoryOption(command, request.memory_gb, "Memory for depth maps that are held at a time [4]");
}

// An option whose value is one of some names.
template <typename T>
void AddChoice(CLI::App& command, const std::string& name, T& value,
               const std::map<std::string, T>& values, const std::string& description) {
  std::vector<std::string> names;
  for (const auto& [text, unused] : values) names.push_back(text);
  command
      .add_option_function<std::string>(
          name, [&value, values](const std::string& text) { value = values.at(text); }, description)
      ->check(CLI::IsMember(names))
      ->type_name(fmt::format("{}", fmt::join(names, "|")));
}

void AddDepthOptions(CLI::App& command, Request& request) {
  using Format = pipeline::DepthFileFormat;
  AddChoice(command, "--depth-format", request.depth_format,
            {{"exr", Format::kExr},
             {"pfm", Format::kPfm},
             {"png16", Format::kPng16},
             {"npy", Format::kNpy}},
            "depth: files of depth [exr]");
  AddChoice(command, "--depth-kind", request.depth_kind,
            {{"z", DepthKind::kPlaneZ}, {"ray", DepthKind::kRayDistance}},
            "depth: z in the camera frame or distance from the camera [z]");
  AddChoice(command, "--grid", request.depth_grid,
            {{"set", pipeline::DepthGrid::kSet}, {"photo", pipeline::DepthGrid::kPhoto}},
            "depth: at the pixels of the set's undistorted images or of the original photos [set]");
}

void AddSplatOptions(CLI::App& command, Request& request) {
  command.add_option("--max-count", request.max_count, "splat: Gaussians at most [no bound]")
      ->check(CLI::Range(1, 2000000000))
      ->type_name("N");
  command.add_flag(
      "--full-sh", request.full_sh,
      "splat: write the coefficients of degrees 1 to 3 too (all 0), which the original "
      "viewer wants");
}

std::vector<std::string> FormatNames() {
  std::vector<std::string> names;
  for (const Format& format : Formats()) names.emplace_back(format.name);
  return names;
}

}  // namespace

void AddExportCommand(CLI::App& app) {
  AddCommand(app, "export",
             "Write a set for other programs: cameras and images, depth maps, clouds, splats",
             "dtr export scene.dtr --format colmap -o colmap/", [](CLI::App& command) -> Action {
               auto options = std::make_shared<Request>();
               command.add_option("SET", options->set, "The set")->required();
               auto format = std::make_shared<std::string>("colmap");
               command.add_option("--format", *format, "Format [colmap]")
                   ->check(CLI::IsMember(FormatNames()))
                   ->type_name(fmt::format("{}", fmt::join(FormatNames(), "|")));
               command.add_flag("--text", options->text,
                                "colmap: COLMAP's text files instead of binary");
               AddCloudOptions(command, *options);
               AddSplatOptions(command, *options);
               AddDepthOptions(command, *options);
               command.add_option("-o,--output", options->output, "Folder or file to write")
                   ->required()
                   ->type_name("PATH");
               return [options, format](const Context& context) {
                 return RunExport(*options, *format, context);
               };
             });
}

}  // namespace dtr::cli
