#include <fmt/format.h>

#include <filesystem>
#include <map>

#include "calib/colmap/export.h"
#include "calib/colmap/model_io.h"
#include "cli/command.h"
#include "cli/output_file.h"
#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/work_folder.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "pipeline/detail/depth/points_from_depth.h"

namespace dtr::cli {
namespace {

namespace fs = std::filesystem;

struct ExportArguments {
  fs::path set, output;
  std::string format = "colmap";
  bool text = false;
};

// A photo's name with the extension of what the set stores, so that other programs are not misled;
// the whole name is kept where two photos differ only in theirs.
void NameByStoredFormat(std::vector<View>& views) {
  std::map<std::string, int> stems;
  for (const View& view : views) ++stems[fs::path(view.name).replace_extension().string()];
  for (View& view : views) {
    const std::string extension = fs::path(view.image_file->path).extension().string();
    const fs::path stem = fs::path(view.name).replace_extension();
    view.name = stems[stem.string()] > 1 ? view.name + extension : stem.string() + extension;
  }
}

void ExportImages(const fs::path& folder, const DtrSet& set, const fs::path& target) {
  for (const View& view : set.frames.front().views) {
    const fs::path file = target / view.name;
    fs::create_directories(file.parent_path());
    CopyFileAtomically(folder / view.image_file->path, file);
  }
}

// A view's image, for the colours of its points: one at a time is in memory.
ImageRgb8 ImageOf(const fs::path& folder, View view, int threads) {
  io::LoadOptions load;
  load.depth = false;
  load.threads = threads;
  io::LoadPixels(folder, view, load);
  return std::move(view.image);
}

int RunExport(ExportArguments options, const Context& context) {
  options.output = WithoutTrailingSlash(options.output);
  if (fs::exists(options.output)) {
    throw UsageError(
        fmt::format("{}: exists already; choose another folder", options.output.string()));
  }
  RequireFolderOf(options.output, "-o");
  DtrSet set = io::ReadSet(options.set);
  WorkFolder work(WorkFolder::Of(options.output), "export");
  SparseScene sparse = set.sparse_file ? io::LoadSparse(options.set, set) : SparseScene{};
  const bool from_depth = sparse.points.empty() && set.frames.size() == 1;
  if (from_depth) {
    sparse =
        pipeline::PointsFromDepth(options.set, set, {}, context.common.threads, context.console);
  }
  NameByStoredFormat(set.frames.front().views);
  const calib::SfmModel model = colmap::ModelFromViews(set, sparse, [&](const View& view) {
    return ImageOf(options.set, view, context.common.threads);
  });
  ExportImages(options.set, set, work.path() / "images");
  colmap::WriteModel(work.path() / "sparse" / "0", model,
                     options.text ? colmap::Format::kText : colmap::Format::kBinary);
  work.Become(options.output);
  context.console.Say(fmt::format("{}: {} images, {} points{}", options.output.string(),
                                  model.images.size(), model.points.size(),
                                  from_depth ? " from depth, as the set has no sparse ones" : ""));
  context.EmitJson(fmt::format("{{\"images\": {}, \"points\": {}, \"points_from\": \"{}\"}}",
                               model.images.size(), model.points.size(),
                               from_depth ? "depth" : "sparse"));
  return kDone;
}

}  // namespace

void AddExportCommand(CLI::App& app) {
  AddCommand(app, "export",
             "Write a set's cameras, points and images for another program: sparse/0 and images",
             "dtr export scene.dtr --format colmap -o colmap/", [](CLI::App& command) -> Action {
               auto options = std::make_shared<ExportArguments>();
               command.add_option("SET", options->set, "The set")->required();
               command.add_option("--format", options->format, "Format [colmap]")
                   ->check(CLI::IsMember({"colmap"}))
                   ->type_name("colmap");
               command.add_flag("--text", options->text, "COLMAP's text files instead of binary");
               command.add_option("-o,--output", options->output, "Folder to write")
                   ->required()
                   ->type_name("DIR");
               return [options](const Context& context) { return RunExport(*options, context); };
             });
}

}  // namespace dtr::cli
