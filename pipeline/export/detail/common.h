// pipeline/export/detail/common.h -- what all exports begin with.
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/pose.h"
#include "pipeline/export/detail/surface_views.h"
#include "pipeline/export/export.h"

namespace dtr::pipeline {

/// The set to export, without pixels. Notes where its validation failed. Throws UsageError when the
/// output exists, Error for a broken set and for one of several time steps; `format` is what the
/// message calls it.
DtrSet SetToExport(const ExportRequest& request, const char* format, Progress& progress);

/// SetToExport, where at least one view must have depth. Throws Error.
DtrSet SetWithDepth(const ExportRequest& request, const char* format, Progress& progress);

/// An export that is a folder of a set with depth: `write` fills a work folder, which then becomes
/// request.output. Throws as SetWithDepth and as `write`, and leaves nothing then.
ExportReport ExportFolder(
    const ExportRequest& request, const char* format, Progress& progress,
    const std::function<ExportReport(const DtrSet&, const std::filesystem::path&)>& write);

/// Leaves capture::kExportFile in a folder of an export, by which a folder of photos around it
/// tells its images from photos: `format` and SetFacts.
void MarkExport(const DtrSet& set, const char* format, const std::filesystem::path& folder);

/// How surfaces are read for a request: measured depth, with completed where it asks for it.
SurfaceViews::Options SurfaceOptions(const ExportRequest& request, bool colours = false);

/// Calls `write` with each view that has depth, in the set's order, and with its number among them,
/// from 0. Reports progress and stops where that asks for it.
void ForEachDepth(
    SurfaceViews& surfaces, Progress& progress,
    const std::function<void(size_t number, const View& view, const SurfaceView& surface)>& write);

/// Names of the views' files: the photos' names with `extension` instead of their own; the whole
/// name before it where two photos differ only in that.
std::vector<std::string> FileNames(const std::vector<View>& views, const std::string& extension);

/// The same for images, with the extension of what the set stores of each.
std::vector<std::string> ImageNames(const std::vector<View>& views);

/// What every sidecar says of the set: tool, unit, world_origin, validation result.
nlohmann::ordered_json SetFacts(const DtrSet& set);
/// The same as lines of text, for comments of files.
std::vector<std::string> FactLines(const DtrSet& set);

/// "500000 4500000.25 100": with enough digits to read back the same numbers.
std::string NumbersText(const Eigen::Vector3d& v);

/// Notes that coordinates are relative to the set's origin, where that is not zero.
void NoteOffset(const DtrSet& set, Progress& progress);

/// [R t; 0 0 0 1], row by row.
nlohmann::ordered_json MatrixJson(const Pose& pose);

/// `file`, the folder of which now exists.
std::filesystem::path InItsFolder(const std::filesystem::path& file);

/// Writes JSON with a line break at its end, atomically.
void WriteJson(const std::filesystem::path& file, const nlohmann::ordered_json& json);

}  // namespace dtr::pipeline
