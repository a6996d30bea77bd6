#include "pipeline/export.h"

#include <fmt/format.h>

#include <map>

#include "calib/colmap/export.h"
#include "calib/colmap/model_io.h"
#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/work_folder.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "pipeline/detail/depth/points_from_depth.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

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

}  // namespace

ExportReport ExportColmap(const ExportRequest& request, Progress& progress) {
  const fs::path output = WithoutTrailingSlash(request.output);
  if (fs::exists(output)) {
    throw UsageError(fmt::format("{}: exists already; choose another folder", output.string()));
  }
  DtrSet set = io::ReadSet(request.set);
  WorkFolder work(WorkFolder::Of(output), "export");
  SparseScene sparse = set.sparse_file ? io::LoadSparse(request.set, set) : SparseScene{};
  ExportReport report;
  report.points_from_depth = sparse.points.empty() && set.frames.size() == 1;
  if (report.points_from_depth) {
    sparse = PointsFromDepth(request.set, set, {}, request.threads, progress);
  }
  NameByStoredFormat(set.frames.front().views);
  const calib::SfmModel model = colmap::ModelFromViews(
      set, sparse, [&](const View& view) { return ImageOf(request.set, view, request.threads); });
  ExportImages(request.set, set, work.path() / "images");
  colmap::WriteModel(work.path() / "sparse" / "0", model,
                     request.text ? colmap::Format::kText : colmap::Format::kBinary);
  work.Become(output);
  report.images = model.images.size();
  report.points = model.points.size();
  return report;
}

}  // namespace dtr::pipeline
