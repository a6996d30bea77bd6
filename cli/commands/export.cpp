#include "pipeline/export.h"

#include <fmt/format.h>

#include "cli/command.h"
#include "cli/output_file.h"
#include "dtr/base/files.h"
#include "pipeline/export_web.h"

namespace dtr::cli {
namespace {

struct ExportOptions {
  std::string format = "colmap";
  pipeline::ExportRequest colmap;
  pipeline::WebPageRequest web;
};

int RunColmap(pipeline::ExportRequest request, const Context& context) {
  request.output = WithoutTrailingSlash(request.output);
  if (!std::filesystem::exists(request.output)) RequireFolderOf(request.output, "-o");
  request.threads = context.common.threads;
  const pipeline::ExportReport report = pipeline::ExportColmap(request, context.console);
  context.console.Say(fmt::format(
      "{}: {} images, {} points{}", request.output.string(), report.images, report.points,
      report.points_from_depth ? " from depth, as the set has no sparse ones" : ""));
  context.EmitJson(fmt::format("{{\"images\": {}, \"points\": {}, \"points_from\": \"{}\"}}",
                               report.images, report.points,
                               report.points_from_depth ? "depth" : "sparse"));
  return kDone;
}

int RunWeb(const pipeline::WebPageRequest& request, const Context& context) {
  RequireOutputFile(request.output, "-o", {".html", ".htm"});
  const pipeline::WebPageReport report = pipeline::ExportWebPage(request, context.console);
  if (!report.warning.empty()) context.console.Note(report.warning);
  const std::string photos = report.jpeg_quality > 0
                                 ? fmt::format("photos of JPEG quality {}", report.jpeg_quality)
                                 : "photos as in the set";
  context.console.Say(fmt::format(
      "{}: {} views, {:.2f} MB, {}, depth within {} px of disparity", request.output.string(),
      report.views, static_cast<double>(report.bytes) / 1e6, photos, report.depth_error_px));
  context.EmitJson(
      fmt::format("{{\"views\": {}, \"bytes\": {}, \"jpeg_quality\": {}, \"depth_error_px\": {}}}",
                  report.views, report.bytes, report.jpeg_quality, report.depth_error_px));
  return kDone;
}

int RunExport(ExportOptions options, const Context& context) {
  options.web.set = options.colmap.set;
  options.web.output = options.colmap.output;
  return options.format == "web" ? RunWeb(options.web, context)
                                 : RunColmap(options.colmap, context);
}

void RequireFormat(const ExportOptions& options) {
  const bool web = options.format == "web";
  if (web && options.colmap.text)
    throw UsageError("--text conflicts with --format web; leave one of them out");
  if (!web && (options.web.max_mb || options.web.jpeg_quality)) {
    throw UsageError("--max-mb and --jpeg-quality need --format web");
  }
}

}  // namespace

void AddExportCommand(CLI::App& app) {
  AddCommand(app, "export",
             "Write a set for other programs: COLMAP's cameras, points and images, or a web page",
             "dtr export scene.dtr --format web -o scene.html", [](CLI::App& command) -> Action {
               auto options = std::make_shared<ExportOptions>();
               command.add_option("SET", options->colmap.set, "The set")->required();
               command
                   .add_option("--format", options->format,
                               "colmap: a folder with sparse/0 and images; web: one HTML file that "
                               "shows the scene in a browser, without a server [colmap]")
                   ->check(CLI::IsMember({"colmap", "web"}))
                   ->type_name("colmap|web");
               command.add_flag("--text", options->colmap.text,
                                "colmap: text files instead of binary");
               command
                   .add_option("--max-mb", options->web.max_mb,
                               "web: at most N MB (10^6 bytes); photos and depth are coded more "
                               "coarsely until the page fits")
                   ->check(CLI::PositiveNumber)
                   ->type_name("N");
               command
                   .add_option("--jpeg-quality", options->web.jpeg_quality,
                               "web: of the photos [85, or the JPEG that the set stores]")
                   ->check(CLI::Range(1, 100))
                   ->type_name("Q");
               command.add_option("-o,--output", options->colmap.output, "What to write")
                   ->required()
                   ->type_name("DIR|FILE.html");
               return [options](const Context& context) {
                 RequireFormat(*options);
                 return RunExport(*options, context);
               };
             });
}

}  // namespace dtr::cli
