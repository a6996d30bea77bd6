#include "pipeline/export/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>

#include "calib/colmap/export.h"
#include "calib/colmap/model_io.h"
#include "dtr/base/durable.h"
#include "dtr/base/files.h"
#include "dtr/base/work_folder.h"
#include "pipeline/export/detail/coloured_points.h"
#include "pipeline/export/detail/common.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

void ExportImages(const fs::path& folder, const DtrSet& set, const fs::path& target) {
  for (const View& view : set.frames.front().views) {
    const fs::path file = target / view.name;
    fs::create_directories(file.parent_path());
    CopyFileAtomically(folder / view.image_file->path, file);
  }
}

// Readers of COLMAP's text files, COLMAP's own among them, end a name at a blank.
void NameWithoutBlanks(std::vector<View>& views, Progress& progress) {
  std::set<std::string> taken;
  for (const View& view : views) taken.insert(view.name);
  size_t renamed = 0;
  for (View& view : views) {
    const fs::path old = view.name;
    std::string stem = (old.parent_path() / old.stem()).string();
    std::string extension = old.extension().string();
    for (std::string* text : {&stem, &extension}) {
      std::replace_if(
          text->begin(), text->end(), [](unsigned char c) { return std::isspace(c) != 0; }, '_');
    }
    if (stem + extension == view.name) continue;
    std::string name = stem + extension;
    for (int n = 2; !taken.insert(name).second; ++n)
      name = fmt::format("{}-{}{}", stem, n, extension);
    view.name = name;
    ++renamed;
  }
  if (renamed == 0) return;
  progress.Note(fmt::format(
      "{} images get _ for the blanks in their names: readers of COLMAP's text files end a name at "
      "a blank",
      renamed));
}

}  // namespace

ExportReport ExportColmap(const ExportRequest& request, Progress& progress) {
  const fs::path output = WithoutTrailingSlash(request.output);
  DtrSet set = SetToExport(request, "COLMAP", progress);
  WorkFolder work(WorkFolder::Of(output), "export");
  const StartPoints start = StartPointsOf(request.set, set, progress);
  ExportReport report;
  report.points_from_depth = start.from_depth;
  std::vector<View>& views = set.frames.front().views;
  const std::vector<std::string> names = ImageNames(views);
  for (size_t i = 0; i < views.size(); ++i) views[i].name = names[i];
  if (request.text) NameWithoutBlanks(views, progress);
  const calib::SfmModel model = colmap::ModelFromViews(
      set, start.scene, [&](const View& view) { return ImageOf(request.set, view); });
  ExportImages(request.set, set, work.path() / "images");
  colmap::WriteModel(work.path() / "sparse" / "0", model,
                     request.text ? colmap::Format::kText : colmap::Format::kBinary);
  MarkExport(set, "colmap", work.path());
  work.Become(output);
  report.images = model.images.size();
  report.points = model.points.size();
  return report;
}

}  // namespace dtr::pipeline
