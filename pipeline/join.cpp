#include "pipeline/join.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/hash.h"
#include "dtr/io/set_io.h"
#include "dtr/render/view_stream.h"
#include "dtr/types/widen_bounds.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

DtrSet ReadStill(const fs::path& folder) {
  DtrSet set = io::ReadSet(folder);
  if (set.frames.size() != 1) {
    throw UsageError(fmt::format("{}: expected a set of one frame, found {}", folder.string(),
                                 set.frames.size()));
  }
  return set;
}

/// What decides the result: the sets' descriptions, which hold the hashes of their files.
nlohmann::json FingerprintOf(const std::vector<fs::path>& sets, const JoinOptions& options) {
  nlohmann::json json{{"command", "join"},
                      {"frames_per_second", options.frames_per_second},
                      {"sets", nlohmann::json::array()}};
  for (const fs::path& folder : sets) {
    json["sets"].push_back({{"name", WithoutTrailingSlash(folder).filename().string()},
                            {"set_json_sha256", Sha256OfFile(folder / "set.json")}});
  }
  return json;
}

/// How lengths and axes were found: kept where all sets say the same, with one world.
nlohmann::json ProvenanceOf(const std::vector<DtrSet>& stills, const nlohmann::json& fingerprint) {
  nlohmann::json provenance{{"joined", fingerprint}};
  std::optional<nlohmann::json> scale;
  for (const DtrSet& still : stills) {
    const nlohmann::json own = nlohmann::json::parse(still.provenance_json, nullptr, false);
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

void WriteViews(const fs::path& folder, size_t index, Frame& frame, LengthUnit unit,
                const JoinOptions& options, io::SetWriter& writer, Progress& progress) {
  io::LoadOptions load;
  load.sigma = load.held_out = load.completed = true;
  load.threads = options.threads;
  load.warn = [&](const std::string& line) { progress.Note(line); };
  for (View& view : frame.views) {
    progress.ThrowIfInterrupted();
    View joined = view;
    joined.id = fmt::format("t{:04}_{}", index, view.id);
    for (auto* file : {&joined.image_file, &joined.mask_file, &joined.depth_file,
                       &joined.completed_file, &joined.sigma_file, &joined.mesh_file,
                       &joined.depth_base, &joined.completed_base, &joined.sigma_base}) {
      file->reset();
    }
    joined.image_frame.reset();
    const bool written = writer.RestoreView(joined);  // by a run that was interrupted
    load.images = load.sigma = !written;
    if (!written || view.mesh_file) io::LoadPixels(folder, view, load);
    const std::optional<StoredMesh> mesh = std::exchange(view.mesh, {});
    if (!written) {
      joined.image = std::move(view.image);
      joined.mask = std::move(view.mask);
      joined.depth = std::move(view.depth);
      joined.depth_state = std::move(view.depth_state);
      joined.inverse_depth_sigma = std::move(view.inverse_depth_sigma);
      writer.WriteView(joined, unit);
    }
    if (mesh) writer.WriteMesh(joined, *mesh);
    DropPixels(joined);
    view = std::move(joined);
  }
}

}  // namespace

void JoinSets(const std::vector<fs::path>& sets, const fs::path& target, const JoinOptions& options,
              Progress& progress) {
  if (sets.size() < 2) throw UsageError("join: expected two sets or more, one for each time step");
  std::vector<DtrSet> stills;
  for (const fs::path& folder : sets) {
    stills.push_back(ReadStill(folder));
    if (stills.back().unit != stills.front().unit) {
      throw Error(fmt::format(
          "{}: unit: expected {} as in {}, found {}; dtr calibrate scale brings a set into metres",
          folder.string(), NameOf(stills.front().unit), sets.front().string(),
          NameOf(stills.back().unit)));
    }
  }
  const nlohmann::json fingerprint = FingerprintOf(sets, options);
  io::SetWriter writer(target, fingerprint.dump(), options.force);
  DtrSet moving;
  moving.unit = stills.front().unit;
  moving.world_origin = stills.front().world_origin;
  moving.provenance_json = ProvenanceOf(stills, fingerprint).dump();
  progress.Stage("joining frames", static_cast<int>(sets.size()));
  for (size_t i = 0; i < sets.size(); ++i) {
    DtrSet& still = stills[i];
    MoveTo(moving.world_origin, still);
    moving.scene_center += still.scene_center / static_cast<double>(sets.size());
    Widen(still.bounds, moving.bounds);
    Frame frame = std::move(still.frames.front());
    frame.time_s = static_cast<double>(i) / options.frames_per_second;
    WriteViews(sets[i], i, frame, moving.unit, options, writer, progress);
    moving.frames.push_back(std::move(frame));
    progress.Update(static_cast<int>(i) + 1);
  }
  writer.Finish(moving);
}

}  // namespace dtr::pipeline
