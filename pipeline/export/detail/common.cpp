#include "pipeline/export/detail/common.h"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>

#include "capture/store.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/work_folder.h"
#include "dtr/io/set_io.h"
#include "dtr/io/validation_result.h"
#include "pipeline/core/run/output_folder.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// `extensions`: of each view's file.
std::vector<std::string> NamesWith(const std::vector<View>& views,
                                   const std::vector<std::string>& extensions) {
  std::map<std::string, int> stems;
  for (const View& view : views) ++stems[fs::path(view.name).replace_extension().string()];
  std::vector<std::string> names;
  for (size_t i = 0; i < views.size(); ++i) {
    const std::string stem = fs::path(views[i].name).replace_extension().string();
    names.push_back((stems[stem] > 1 ? views[i].name : stem) + extensions[i]);
  }
  return names;
}

}  // namespace

DtrSet SetToExport(const ExportRequest& request, const char* format, Progress& progress) {
  RequireNew(WithoutTrailingSlash(request.output), "export", request.force);
  DtrSet set = io::ReadSet(request.set);
  if (set.frames.size() != 1) {
    throw Error(fmt::format(
        "export to {}: expected a set with one frame, found {}; the format shows one time step",
        format, set.frames.size()));
  }
  const std::string warning = io::ValidationWarning(set);
  if (!warning.empty()) progress.Note(warning);
  return set;
}

DtrSet SetWithDepth(const ExportRequest& request, const char* format, Progress& progress) {
  DtrSet set = SetToExport(request, format, progress);
  for (const View& view : set.frames.front().views) {
    if (view.depth_file) return set;
  }
  throw Error(fmt::format("{}: no view has depth, which {} needs; run dtr stereo on it",
                          request.set.string(), format));
}

ExportReport ExportFolder(
    const ExportRequest& request, const char* format, Progress& progress,
    const std::function<ExportReport(const DtrSet&, const fs::path&)>& write) {
  const DtrSet set = SetWithDepth(request, format, progress);
  NoteOffset(set, progress);
  const fs::path output = WithoutTrailingSlash(request.output);
  WorkFolder work(WorkFolder::Of(output), "export");
  const ExportReport report = write(set, work.path());
  MarkExport(set, format, work.path());
  work.Become(output);
  return report;
}

void MarkExport(const DtrSet& set, const char* format, const fs::path& folder) {
  Json mark = {{"format", format}};
  mark.update(SetFacts(set));
  WriteJson(folder / capture::kExportFile, mark);
}

SurfaceViews::Options SurfaceOptions(const ExportRequest& request, bool colours) {
  return {.completed = request.completed, .colours = colours, .memory_gb = request.memory_gb};
}

void ForEachDepth(SurfaceViews& surfaces, Progress& progress,
                  const std::function<void(size_t, const View&, const SurfaceView&)>& write) {
  const std::vector<int> views = surfaces.WithDepth();
  progress.Stage("depth", static_cast<int>(views.size()));
  for (size_t i = 0; i < views.size(); ++i) {
    progress.ThrowIfInterrupted();
    const auto surface = surfaces.Get(views[i]);
    write(i, surfaces.set().frames.front().views[static_cast<size_t>(views[i])], *surface);
    progress.Update(static_cast<int>(i) + 1);
  }
}

std::vector<std::string> FileNames(const std::vector<View>& views, const std::string& extension) {
  return NamesWith(views, std::vector<std::string>(views.size(), extension));
}

std::vector<std::string> ImageNames(const std::vector<View>& views) {
  std::vector<std::string> extensions;
  for (const View& view : views) {
    extensions.push_back(fs::path(view.image_file->path).extension().string());
  }
  return NamesWith(views, extensions);
}

Json SetFacts(const DtrSet& set) {
  return {{"tool", "dtr"},
          {"tool_version", DTR_VERSION},
          {"unit", NameOf(set.unit)},
          {"world_origin", {set.world_origin.x(), set.world_origin.y(), set.world_origin.z()}},
          {"validation", io::ValidationLine(set)}};
}

std::vector<std::string> FactLines(const DtrSet& set) {
  return {fmt::format("written by dtr {}", DTR_VERSION), fmt::format("unit {}", NameOf(set.unit)),
          fmt::format("validation {}", io::ValidationLine(set))};
}

std::string NumbersText(const Eigen::Vector3d& v) {
  return fmt::format("{} {} {}", v.x(), v.y(), v.z());
}

void NoteOffset(const DtrSet& set, Progress& progress) {
  if (set.world_origin.isZero(0)) return;
  progress.Note(fmt::format(
      "coordinates are relative to {}, as the format's floats cannot hold them; the file says so",
      NumbersText(set.world_origin)));
}

Json MatrixJson(const Pose& pose) {
  const Eigen::Matrix3d r = pose.rotation.toRotationMatrix();
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i) rows.push_back({r(i, 0), r(i, 1), r(i, 2), pose.translation[i]});
  rows.push_back({0, 0, 0, 1});
  return rows;
}

fs::path InItsFolder(const fs::path& file) {
  fs::create_directories(file.parent_path());
  return file;
}

void WriteJson(const fs::path& file, const Json& json) {
  WriteFileAtomically(file, json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace dtr::pipeline
