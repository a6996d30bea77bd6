#include "pipeline/build/join.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/hash.h"
#include "dtr/io/set_io.h"
#include "dtr/io/still_once.h"
#include "dtr/render/time_steps.h"
#include "dtr/render/view_stream.h"
#include "dtr/types/widen_bounds.h"
#include "pipeline/core/depth_settings.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

/// A time step of a set: the set at that time, without pixels.
struct JoinedStep {
  fs::path folder;
  DtrSet still;
  double time_s = 0;
  bool is_of_dynamic = false;  // whose ids begin with the time step
};

/// What decides the result: the sets' descriptions, which hold the hashes of their files.
nlohmann::json FingerprintOf(const std::vector<fs::path>& sets, const JoinOptions& options) {
  nlohmann::json json{{"command", "join"},
                      {"frames_per_second", options.frames_per_second},
                      {"sets", nlohmann::json::array()}};
  if (options.video) json["video"] = io::NameOf(*options.video);
  for (const fs::path& folder : sets) {
    json["sets"].push_back({{"name", WithoutTrailingSlash(folder).filename().string()},
                            {"set_json_sha256", Sha256OfFile(folder / "set.json")}});
  }
  return json;
}

/// How lengths and axes were found: kept where all sets say the same, with one world.
nlohmann::json ProvenanceOf(const std::vector<JoinedStep>& steps,
                            const nlohmann::json& fingerprint) {
  nlohmann::json provenance{{"joined", fingerprint}};
  std::optional<nlohmann::json> scale;
  for (const JoinedStep& step : steps) {
    const nlohmann::json own = nlohmann::json::parse(step.still.provenance_json, nullptr, false);
    if (!own.is_object() || !own.contains("scale")) return provenance;
    if (scale && *scale != own["scale"]) return provenance;
    scale = own["scale"];
  }
  if (scale) provenance["scale"] = *scale;
  return provenance;
}

/// The set in the world of the first one: its poses act on p - `origin`, box and centre are there.
void MoveTo(const Eigen::Vector3d& origin, DtrSet& set) {
  const Eigen::Vector3d shift = origin - set.world_origin;
  for (View& view : set.frames.front().views) {
    view.cam_from_world.translation += view.cam_from_world.rotation * shift;
  }
  set.scene_center -= shift;
  set.bounds.min -= shift;
  set.bounds.max -= shift;
  set.world_origin = origin;
}

/// The time steps of all sets, in order.
std::vector<JoinedStep> StepsOf(const std::vector<fs::path>& sets, double frames_per_second) {
  std::vector<JoinedStep> steps;
  LengthUnit unit{};
  double next_s = 0;  // when the next set begins
  for (const fs::path& folder : sets) {
    DtrSet set = io::ReadSet(folder);
    if (steps.empty()) unit = set.unit;
    if (set.unit != unit) {
      throw Error(fmt::format(
          "{}: unit: expected {} as in {}, found {}; dtr calibrate scale brings a set into metres",
          folder.string(), NameOf(unit), sets.front().string(), NameOf(set.unit)));
    }
    const FrameClock clock(set);
    const double period_s = set.frames.size() > 1 ? clock.period_s() : 1 / frames_per_second;
    std::vector<DtrSet> stills = SplitFrames(std::move(set));
    for (size_t i = 0; i < stills.size(); ++i) {
      steps.push_back({folder, std::move(stills[i]), next_s + clock.StartOf(i), stills.size() > 1});
    }
    next_s += period_s;
  }
  return steps;
}

/// The id without the time step that an earlier join or build gave it.
std::string IdOfCamera(const std::string& id) {
  const size_t digits = id.find_first_not_of("0123456789", 1);
  const bool timed = id.starts_with('t') && digits != std::string::npos && digits > 4;
  return timed && id[digits] == '_' && digits + 1 < id.size() ? id.substr(digits + 1) : id;
}

View Joined(const View& view, size_t index, bool is_of_dynamic) {
  View joined = view;
  joined.id = fmt::format("t{:04}_{}", index, is_of_dynamic ? IdOfCamera(view.id) : view.id);
  for (auto* file : {&joined.image_file, &joined.mask_file, &joined.depth_file,
                     &joined.completed_file, &joined.sigma_file, &joined.mesh_file,
                     &joined.depth_base, &joined.completed_base, &joined.sigma_base}) {
    file->reset();
  }
  joined.image_frame.reset();
  return joined;
}

/// Views of a time step, without their meshes.
Frame WriteViews(const JoinedStep& step, size_t index, const io::LoadOptions& load, LengthUnit unit,
                 io::SetWriter& writer, const Progress& progress) {
  Frame frame;
  frame.time_s = step.time_s;
  for (const View& view : step.still.frames.front().views) {
    progress.ThrowIfInterrupted();
    View joined = Joined(view, index, step.is_of_dynamic);
    if (!writer.RestoreView(joined)) {  // by a run that was interrupted
      View source = view;
      source.mesh_file.reset();
      io::LoadPixels(step.folder, source, load);
      joined.image = std::move(source.image);
      joined.mask = std::move(source.mask);
      joined.depth = std::move(source.depth);
      joined.depth_state = std::move(source.depth_state);
      joined.inverse_depth_sigma = std::move(source.inverse_depth_sigma);
      writer.WriteView(joined, unit);
      DropPixels(joined);
    }
    frame.views.push_back(std::move(joined));
  }
  return frame;
}

/// Of every view that has one. After depth has its last files, which a mesh names.
void WriteMeshes(const std::vector<JoinedStep>& steps, io::LoadOptions load, io::SetWriter& writer,
                 DtrSet& moving, Progress& progress) {
  progress.Stage("meshes", static_cast<int>(steps.size()));
  load.images = load.sigma = load.held_out = false;  // a mesh is of completed depth, too
  for (size_t i = 0; i < steps.size(); ++i) {
    const std::vector<View>& sources = steps[i].still.frames.front().views;
    for (size_t v = 0; v < sources.size(); ++v) {
      progress.ThrowIfInterrupted();
      if (!sources[v].mesh_file) continue;
      View source = sources[v];
      io::LoadPixels(steps[i].folder, source, load);
      if (source.mesh) writer.WriteMesh(moving.frames[i].views[v], *source.mesh);
    }
    progress.Update(static_cast<int>(i) + 1);
  }
}

}  // namespace

size_t JoinSets(const std::vector<fs::path>& sets, const fs::path& target,
                const JoinOptions& options, Progress& progress) {
  if (sets.size() < 2) throw UsageError("join: expected two sets or more, in order of time");
  if (options.video) io::RequireVideoEncoder();
  std::vector<JoinedStep> steps = StepsOf(sets, options.frames_per_second);
  const nlohmann::json fingerprint = FingerprintOf(sets, options);
  io::SetWriter writer(target, fingerprint.dump(), options.force);
  DtrSet moving;
  moving.unit = steps.front().still.unit;
  moving.world_origin = steps.front().still.world_origin;
  moving.provenance_json = ProvenanceOf(steps, fingerprint).dump();
  io::LoadOptions load;
  load.sigma = load.held_out = load.completed = true;
  load.warn = [&](const std::string& line) { progress.Note(line); };
  progress.Stage("joining frames", static_cast<int>(steps.size()));
  for (size_t i = 0; i < steps.size(); ++i) {
    DtrSet& still = steps[i].still;
    MoveTo(moving.world_origin, still);
    moving.scene_center += still.scene_center / static_cast<double>(steps.size());
    Widen(still.bounds, moving.bounds);
    moving.frames.push_back(WriteViews(steps[i], i, load, moving.unit, writer, progress));
    progress.Update(static_cast<int>(i) + 1);
  }
  io::StoreStillOnce(writer.folder(), moving, kDefaultMemoryGb, progress);
  WriteMeshes(steps, load, writer, moving, progress);
  if (options.video) {
    io::StoreCameraVideos(writer.folder(), writer.work_folder(), moving, *options.video,
                          kDefaultMemoryGb, progress);
  }
  writer.Finish(moving);
  return steps.size();
}

}  // namespace dtr::pipeline
