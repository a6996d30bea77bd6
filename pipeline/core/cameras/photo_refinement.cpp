#include "pipeline/core/cameras/photo_refinement.h"

#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>

#include "calib/bundle/one_position.h"
#include "calib/bundle/refine.h"
#include "calib/colmap/model_io.h"
#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/machine.h"
#include "pipeline/core/camera_file.h"
#include "pipeline/core/photos/folder_cameras.h"
#include "pipeline/core/photos/input_hash.h"
#include "pipeline/core/reports/calibration_json.h"
#include "pipeline/core/reports/metres_json.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr char kRecord[] = "refined.json";  // written last: it stands for a model that is whole
constexpr char kModel[] = "model";
constexpr std::uintmax_t kLargestRecordBytes = 16u << 20;

calib::RefineOptions RefineOptionsFor(const CalibrateOptions& options, Progress& progress) {
  calib::RefineOptions refine;
  refine.determined = options.determined;
  refine.advice = options.advice;
  refine.separate_lenses = options.sfm.camera_per == CameraPer::kPhoto;
  refine.seed = options.seed;
  refine.progress = &progress;
  return refine;
}

void Remark(const calib::Refined& refined, PhotoRefinement& out) {
  if (std::string remark = calib::RemarkOn(refined); !remark.empty()) {
    out.notes.push_back(std::move(remark));
  }
}

// Holds what is known in metres.
void HoldMetres(const capture::Capture& capture, const CalibrateOptions& options,
                const calib::RefineOptions& refine, PhotoRefinement& out) {
  const PhotoPositions places = PhotoPositionsOf(capture, calib::ImageNames(out.model));
  if (options.metres.gps) RequirePlaces(places, "`gps`", "those with a camera");
  RefinedInMetres refined = RefineInMetres(out.model, options.metres, places, refine);
  out.report.bundle_adjustment = {.refined = refined.refined, .metres = std::move(refined.report)};
  out.model = std::move(refined.refined.model);
  Remark(refined.refined, out);
  out.notes.insert(out.notes.end(), refined.lines.begin(), refined.lines.end());
}

// Where it pays; deterministic.
void RefineLenses(const capture::Capture& capture, const CalibrateOptions& options,
                  calib::RefineOptions refine, PhotoRefinement& out) {
  if (options.lens) {
    refine.known_lenses.emplace();
    for (const auto& [id, camera] : out.model.cameras) {
      refine.known_lenses->emplace(id, LensFor(*options.lens, camera.width_px, camera.height_px,
                                               fmt::format("camera {}", id)));
    }
  }
  if (options.fixed_intrinsics) refine.known_lenses = out.model.cameras;
  if (options.metres.any()) return HoldMetres(capture, options, refine, out);
  calib::Refined refined = calib::Refine(out.model, refine);
  out.report.bundle_adjustment = {.refined = refined, .metres = {}};
  if (!refined.changed) out.notes.push_back("bundle adjustment left out: " + refined.reason);
  Remark(refined, out);
  out.model = std::move(refined.model);
}

LengthUnit UnitFor(const CalibrateOptions& options) {
  if (options.rig) return options.rig->unit;
  return options.metres.any() ? LengthUnit::kMetre : LengthUnit::kArbitrary;
}

// Which folders share intrinsics.
void ShareFolders(const capture::Capture& capture, const CalibrateOptions& options,
                  const CameraGroups& groups, bool test, PhotoRefinement& out,
                  const Progress& progress) {
  if (options.sfm.camera_per != CameraPer::kAuto) {
    out.report.camera_sharing = {.camera_per = options.sfm.camera_per, .tests = {}};
  }
  if (groups.pools().empty()) return;
  FolderCameras chosen =
      ChooseFolderCameras(groups, capture, out.model, test, {options.seed, &progress});
  out.report.camera_sharing = {.camera_per = options.sfm.camera_per,
                               .tests = std::move(chosen.tests)};
  out.model = std::move(chosen.model);
  out.notes.insert(out.notes.end(), chosen.notes.begin(), chosen.notes.end());
}

PhotoRefinement WorkOut(const capture::Capture& capture, const CalibrateOptions& options,
                        const CameraGroups& groups, const calib::SfmModel& model,
                        Progress& progress) {
  PhotoRefinement out;
  out.model = model;
  if (options.rig) {
    progress.Stage("bundle adjustment of the rig", 0);
    out.report.rig = {.adjusted = PlaceByRig(*options.rig, capture, out.model, progress),
                      .rig = *options.rig};
  } else {
    if (!groups.pools().empty()) progress.Stage("cameras of folders", 0);
    ShareFolders(capture, options, groups, !options.fixed_intrinsics, out, progress);
    progress.Stage("bundle adjustment", 0);
    RefineLenses(capture, options, RefineOptionsFor(options, progress), out);
    if (std::string line = calib::OnePositionLine(out.model); !line.empty()) {
      out.notes.push_back(std::move(line));
    }
  }
  return out;
}

// Everything that decides the result. A rig is not looked into: builds alone have one, and what
// they keep is of one rig.
Json StampOf(const capture::Capture& capture, const CalibrateOptions& options,
             const CameraGroups& groups, const fs::path& sfm_folder) {
  Json stamp = {{"tool_version", DTR_VERSION},
                {"model_sha256", InputHash(sfm_folder)},
                {"seed", options.seed},
                {"determined", !options.determined.empty()},
                {"metres", JsonOf(options.metres)},
                {"rig", options.rig ? options.rig->file : ""}};
  if (options.lens) {
    stamp["lens"] = {{"model", calib::NameOf(options.lens->model)},
                     {"size_px", {options.lens->width_px, options.lens->height_px}},
                     {"params", options.lens->params}};
  }
  if (options.sfm.camera_per != CameraPer::kAuto) {
    stamp["camera_per"] = NameOf(options.sfm.camera_per);
  }
  if (options.fixed_intrinsics) stamp["fixed_intrinsics"] = true;
  for (const FolderPool& pool : groups.pools()) {
    stamp["folders"].push_back({{"group", pool.group}, {"photos", pool.photos_of}});
  }
  for (const capture::Photo& photo : capture.photos) {
    if (!options.metres.gps || !photo.gps) continue;
    const io::GpsPosition& gps = *photo.gps;
    stamp["places"].push_back({photo.name, gps.latitude_deg, gps.longitude_deg,
                               gps.altitude_m ? Json(*gps.altitude_m) : Json(),
                               gps.horizontal_error_m ? Json(*gps.horizontal_error_m) : Json()});
  }
  return stamp;
}

// A damaged checkpoint costs time, never the job.
std::optional<PhotoRefinement> KeptRefinement(const fs::path& folder,
                                              const std::optional<SetRig>& rig, const Json& stamp) {
  if (!fs::exists(folder / kRecord)) return {};
  try {
    const Json record = Json::parse(ReadFile(folder / kRecord, kLargestRecordBytes));
    if (record.at("stamp") != stamp) return {};
    if (record.at("model_sha256") != InputHash(folder / kModel)) return {};
    PhotoRefinement kept;
    kept.model = colmap::ReadModel(folder / kModel);
    kept.report = RefinementFrom(record.at("report"), rig);
    kept.notes = record.at("notes").get<std::vector<std::string>>();
    kept.earlier_wall_s = record.at("wall_s").get<double>();
    kept.earlier_cpu_s = record.at("cpu_s").get<double>();
    return kept;
  } catch (const Error&) {
    return {};
  } catch (const nlohmann::json::exception&) {
    return {};
  } catch (const std::bad_optional_access&) {  // a record of a rig, and none was given
    return {};
  }
}

void Keep(const PhotoRefinement& refined, const Json& stamp, double wall_s, double cpu_s,
          const fs::path& folder) {
  RemoveTree(folder);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error(folder.string() + ": cannot be made: " + error.message());
  colmap::WriteModel(folder / kModel, refined.model, colmap::Format::kBinary);
  const Json record = {{"stamp", stamp},
                       {"model_sha256", InputHash(folder / kModel)},
                       {"report", RefinementJson(refined.report)},
                       {"notes", refined.notes},
                       {"wall_s", wall_s},
                       {"cpu_s", cpu_s}};
  WriteFileAtomically(folder / kRecord, record.dump(1));
}

}  // namespace

PhotoRefinement RefinePhotos(const capture::Capture& capture, const CalibrateOptions& options,
                             const CameraGroups& groups, const calib::SfmModel& model,
                             const fs::path& sfm_folder, const fs::path& folder,
                             Progress& progress) {
  PhotoRefinement refined;
  if (!options.rig && !options.refine && !options.lens) {
    if (!options.determined.empty()) {
      calib::RefineOptions refine = RefineOptionsFor(options, progress);
      if (options.fixed_intrinsics) refine.known_lenses = model.cameras;
      calib::RequireDetermined(model, refine, options.determined);
    }
    refined.model = model;
    ShareFolders(capture, options, groups, false, refined, progress);
    for (const std::string& line : refined.notes) progress.Note(line);
    return refined;
  }
  const Json stamp = StampOf(capture, options, groups, sfm_folder);
  if (auto kept = KeptRefinement(folder, options.rig, stamp)) {
    refined = std::move(*kept);
  } else {
    const double cpu_start_ms = ProcessCpuMilliseconds();
    const auto start = std::chrono::steady_clock::now();
    refined = WorkOut(capture, options, groups, model, progress);
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
    Keep(refined, stamp, wall.count(), (ProcessCpuMilliseconds() - cpu_start_ms) / 1e3, folder);
  }
  refined.unit = UnitFor(options);
  for (const std::string& line : refined.notes) progress.Note(line);
  return refined;
}

}  // namespace dtr::pipeline
