// pipeline/core/cameras/camera_formats.h -- the one list of formats that known cameras come in.
#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "calib/sfm_model.h"
#include "dtr/io/formats/file_look.h"
#include "dtr/io/formats/foreign_scene.h"

namespace dtr::pipeline {

/// A format of files that say where photos were taken.
struct CameraFormat {
  const char* name;     ///< of --format
  const char* program;  ///< and file, as messages call it
  bool (*looks_so)(const std::filesystem::path& file, const io::FileLook& look);
  /// Null for formats that need to know the photos while they are read: COLMAP's, cameras.json,
  /// transforms.json, LLFF's and captures (io::RgbdFormats).
  io::ForeignScene (*read)(const std::filesystem::path& file);
};

/// All of them, in the order in which they are tried.
std::span<const CameraFormat> CameraFormatTable();

/// The format called `name`, or the one that the content shows where it is empty; `what` is the
/// option in messages. Throws UsageError where there is no such file or format, or the file looks
/// like none, Error where a folder does: then all formats are listed, and what it is instead.
CameraFormat FormatOf(const std::filesystem::path& file, const std::string& name,
                      const std::string& what);

/// Whether that is a COLMAP model; false too where the format cannot be told.
bool IsColmapModel(const std::filesystem::path& file, const std::string& name);

/// The model that a COLMAP folder holds. Throws Error as colmap::ReadModel, and for cameras of
/// images whose focal length no camera has. `notes` gets what ReadModel says.
calib::SfmModel ReadGivenModel(const std::filesystem::path& folder,
                               std::vector<std::string>* notes = nullptr);

/// Whether two of its images see a point: others say nothing of where the scene is.
bool HasSharedPoints(const calib::SfmModel& model);

/// One line where it has points and none of them is shared, "" otherwise: such a model counts as
/// one without points. `source`: its folder.
std::string LineOfUnsharedPoints(const calib::SfmModel& model, const std::string& source);

/// The file and those beside it that readers take in: lists of images, tracks.
std::vector<std::filesystem::path> WithCompanions(const std::filesystem::path& file);

}  // namespace dtr::pipeline
