#include "pipeline/metres/scale.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "calib/scale.h"
#include "dtr/base/error.h"
#include "dtr/base/hash.h"
#include "dtr/io/pruned.h"
#include "dtr/io/pruned_json.h"
#include "dtr/io/run_record.h"
#include "dtr/io/set_io.h"
#include "dtr/render/stored_options.h"
#include "dtr/render/stored_options_json.h"
#include "pipeline/core/depth_settings.h"
#include "pipeline/core/reports/set_page.h"
#include "pipeline/core/run/finishing.h"
#include "pipeline/core/run/run_log.h"
#include "pipeline/core/set_rig.h"
#include "pipeline/metres/detail/panorama_positions.h"
#include "pipeline/metres/detail/placed_points.h"
#include "pipeline/metres/detail/scale_board.h"
#include "pipeline/metres/detail/scale_json.h"
#include "pipeline/validate/validate.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// The way into metres, and what is reported of it.
struct Found {
  calib::Similarity metric_from_scene;
  bool keeps_axes = true;
  ScaleReport report;
};

Found FromDistances(const ScaleOptions& options, const DtrSet& set) {
  std::vector<calib::MeasuredDistance> distances;
  for (const ScaleDistance& d : options.distances) {
    const PlacedPoint a = Place(options.set, set, d.a), b = Place(options.set, set, d.b);
    distances.push_back({.name = "`distance` " + d.text,
                         .a = a.p_in_world,
                         .b = b.p_in_world,
                         .covariance_a = a.covariance,
                         .covariance_b = b.covariance,
                         .length_m = d.length_m,
                         .sigma_m = d.sigma_m});
  }
  const calib::DistanceScale scale = calib::ScaleFromDistances(distances);
  Found found;
  found.metric_from_scene.scale = scale.metres_per_unit;
  found.report.relative_sigma = scale.relative_sigma;
  for (size_t i = 0; i < distances.size(); ++i) {
    const ScaledDistance scaled{.text = options.distances[i].text,
                                .units = (distances[i].b - distances[i].a).norm(),
                                .length_m = distances[i].length_m,
                                .sigmas_off = scale.sigmas[i]};
    found.report.distances.push_back(scaled);
    found.report.lines.push_back(fmt::format("{}: {:.6g} units, {:.2f} standard deviations off",
                                             scaled.text, scaled.units, scaled.sigmas_off));
  }
  return found;
}

Found FromGps(const ScaleOptions& options, const DtrSet& set, Progress& progress) {
  Found found;
  std::map<std::string, Eigen::Vector3d> centre_of;
  std::vector<std::string> names;
  for (const View& view : set.frames.front().views) {
    names.push_back(view.name);
    centre_of[view.name] = view.CenterInWorld();
  }
  const std::optional<SetRig> rig = RigOfSet(set);
  const PhotoPositions located = rig && calib::HasOneCentre(rig->known)
                                     ? ReadPanoramaPositions(options.gps, names, progress)
                                     : ReadPhotoPositions(options.gps, names);
  RequirePlaces(located, options.gps.string(), "the set");
  std::vector<std::string>& lines = found.report.lines;
  lines = located.without_place;
  std::vector<Eigen::Vector3d> centres;
  for (const std::string& name : located.names) centres.push_back(centre_of.at(name));
  const calib::PositionScale scale = calib::ScaleFromPositions(centres, located.EastNorthUp());
  found.report.relative_sigma = scale.relative_sigma;
  found.keeps_axes = !(scale.turn_sigma_rad <= calib::kMaxTurnSigmaRad);
  found.metric_from_scene = scale.metric_from_scene;
  if (found.keeps_axes) {
    found.metric_from_scene = {};
    found.metric_from_scene.scale = scale.metric_from_scene.scale;
  }
  ScaledByPositions& positions = found.report.positions.emplace();
  positions.photos = located.names.size();
  for (const size_t i : scale.left_out) positions.left_out.push_back(located.names[i]);
  positions.settled = scale.settled;
  positions.rms_m = scale.rms_m;
  positions.turn_sigma_deg = scale.turn_sigma_rad * 180 / std::numbers::pi;
  if (!found.keeps_axes) positions.origin = located.places[located.Origin()];
  lines.push_back(fmt::format("{} positions, {:.2f} m RMS; rotation known to {:.2g} degrees",
                              positions.photos - positions.left_out.size(), positions.rms_m,
                              positions.turn_sigma_deg));
  if (!positions.left_out.empty()) {
    lines.push_back(fmt::format("do not agree, left out: {}", fmt::join(positions.left_out, ", ")));
  }
  if (!scale.settled) {
    lines.push_back(
        "which positions agree did not settle: with another pass others would be left out");
  }
  lines.push_back(found.keeps_axes
                      ? "the cameras stand nearly on a line, and the rotation about it is not "
                        "known: axes are left as they were"
                      : located.AxesLine());
  return found;
}

Found FromBoard(const ScaleOptions& options, const DtrSet& set, Progress& progress) {
  const calib::Board& board = *options.board;
  BoardInSet in_set = FindBoard(options.set, set, board, progress);
  calib::BoardScale scale = calib::ScaleFromBoard(board, in_set.observations);
  scale.left_out.insert(scale.left_out.end(), in_set.without.begin(), in_set.without.end());
  Found found;
  found.metric_from_scene.scale = 1 / scale.scene_from_board.scale;
  found.report.relative_sigma = scale.relative_sigma;
  for (const calib::LeftOut& item : scale.left_out) {
    found.report.lines.push_back(fmt::format("left out: {}: {}", item.name, item.reason));
  }
  found.report.lines.push_back(
      fmt::format("the board in {} views: {} corners, {} outliers, RMS {:.3f} px",
                  scale.views.size(), scale.corners, scale.outliers, scale.rms_px));
  found.report.board = {.board = calib::TextOf(board), .scale = std::move(scale)};
  return found;
}

Found FindScale(const ScaleOptions& options, const DtrSet& set, Progress& progress) {
  Found found = options.board         ? FromBoard(options, set, progress)
                : options.gps.empty() ? FromDistances(options, set)
                                      : FromGps(options, set, progress);
  found.report.metres_per_unit = found.metric_from_scene.scale;
  return found;
}

Bounds Carried(const Bounds& bounds, const calib::Similarity& b_from_a) {
  if (bounds.empty()) return bounds;
  Bounds carried;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p =
        b_from_a * Eigen::Vector3d((corner & 1 ? bounds.max : bounds.min).x(),
                                   (corner & 2 ? bounds.max : bounds.min).y(),
                                   (corner & 4 ? bounds.max : bounds.min).z());
    carried.min = corner == 0 ? p : Eigen::Vector3d(carried.min.cwiseMin(p));
    carried.max = corner == 0 ? p : Eigen::Vector3d(carried.max.cwiseMax(p));
  }
  return carried;
}

// Thresholds in scene units among the options that the set was pruned for.
void CarryStoredOptions(double scale, DtrSet& set) {
  Json pruned = io::PrunedOf(set);
  if (pruned.is_null()) return;
  const auto [json, where] = io::RenderOptionsOf(set);
  RenderOptions stored = WithStoredOptions({}, json, where);
  for (std::optional<double>* length : {&stored.absolute_delta, &stored.absolute_depth_break}) {
    if (*length) **length *= scale;
  }
  pruned.erase("render_arguments");
  pruned["render"] = JsonOf(stored);
  io::SetPruned(set, pruned);
}

// All that set.json says in lengths. Where axes stay, so does the user's origin.
void Carry(const Found& found, DtrSet& set) {
  const calib::Similarity& metric = found.metric_from_scene;
  set.unit = LengthUnit::kMetre;
  set.world_origin =
      found.keeps_axes ? Eigen::Vector3d(metric.scale * set.world_origin) : Eigen::Vector3d::Zero();
  set.scene_center = metric * set.scene_center;
  set.bounds = Carried(set.bounds, metric);
  CarryStoredOptions(metric.scale, set);
  for (Frame& frame : set.frames) {
    for (View& view : frame.views) {
      view.cam_from_world = metric.CamFromB(view.cam_from_world);
      view.reference_baseline *= metric.scale;
      view.near_z *= metric.scale;
      view.far_z *= metric.scale;
      view.completed_near_z *= metric.scale;  // its file holds shares of this range
      view.completed_far_z *= metric.scale;
    }
  }
}

// Depth and sigma of the old view, times the scale, written for the new one. Float rounding must
// not carry a depth past the ends of its range, which are rounded apart from it.
void CarryDepth(const fs::path& from, View old_view, double scale, View& view, LengthUnit unit,
                io::SetWriter& writer) {
  io::LoadOptions load;
  load.images = false;
  load.sigma = true;
  io::LoadPixels(from, old_view, load);
  const auto near = static_cast<float>(view.near_z), far = static_cast<float>(view.far_z);
  for (float& z : old_view.depth.grid().data()) {
    if (!DepthImage::IsHole(z)) z = std::clamp(static_cast<float>(scale * z), near, far);
  }
  if (old_view.inverse_depth_sigma) {
    for (float& sigma : old_view.inverse_depth_sigma->data()) {
      sigma = static_cast<float>(sigma / scale);
    }
  }
  view.depth = std::move(old_view.depth);
  view.inverse_depth_sigma = std::move(old_view.inverse_depth_sigma);
  writer.WriteView(view, unit);
  view.depth = {};
  view.inverse_depth_sigma.reset();
}

void WriteViews(const ScaleOptions& options, const DtrSet& old_set, double scale, DtrSet& set,
                io::SetWriter& writer, Progress& progress) {
  for (size_t f = 0; f < set.frames.size(); ++f) {
    auto& views = set.frames[f].views;
    progress.Stage("writing in metres", static_cast<int>(views.size()));
    for (size_t i = 0; i < views.size(); ++i) {
      progress.ThrowIfInterrupted();
      const View& old_view = old_set.frames[f].views[i];
      if (writer.RestoreView(views[i])) {
        progress.Update(static_cast<int>(i) + 1);
        continue;
      }
      View unchanged = old_view;
      unchanged.depth_file.reset();
      unchanged.sigma_file.reset();
      unchanged.mesh_file.reset();
      writer.CopyFiles(options.set, unchanged);
      if (old_view.depth_file) CarryDepth(options.set, old_view, scale, views[i], set.unit, writer);
      progress.Update(static_cast<int>(i) + 1);
    }
  }
}

void Record(const ScaleReport& report, DtrSet& set) {
  Json provenance = Json::parse(set.provenance_json);
  if (!provenance["scale"].is_array()) provenance["scale"] = Json::array();
  provenance["scale"].push_back(ScaleJson(report));
  set.provenance_json = provenance.dump();
}

}  // namespace

ScaleReport ScaleSet(const ScaleOptions& options, Progress& progress) {
  RunLog log;
  log.Begin("scale");
  const DtrSet old_set = io::ReadSet(options.set);
  const Found found = FindScale(options, old_set, progress);
  const bool in_place = options.output.empty();
  ScaleReport report = found.report;
  report.written = in_place ? options.set : options.output;
  DtrSet set = old_set;
  Carry(found, set);
  const Json fingerprint = {{"tool_version", DTR_VERSION},
                            {"scale", found.metric_from_scene.scale},
                            {"method", ScaleMethodJson(report)},
                            {"set_sha256", Sha256OfFile(options.set / "set.json")}};
  io::SetWriter writer(report.written, fingerprint.dump(), in_place || options.force);
  WriteViews(options, old_set, found.metric_from_scene.scale, set, writer, progress);
  WriteMeshes(set, writer, kDefaultMemoryGb, progress);
  std::vector<Check> checks;
  if (set.sparse_file) {
    SparseScene sparse = io::LoadSparse(options.set, old_set);
    for (SparsePoint& point : sparse.points) {
      point.p_in_world = found.metric_from_scene * point.p_in_world;
    }
    writer.WriteSparse(set, sparse);
    checks = ValidateSet(writer.folder(), set, sparse, {}, progress).tests;
  }
  Record(report, set);
  WriteSetPage(writer, set,
               {.name = report.written.stem().string(),
                .engine = {},
                .checks = checks,
                .skipped = {},
                .memory_gb = kDefaultMemoryGb},
               progress);
  log.End();
  // What the stages before cost is still what this set cost.
  io::RunRecord record = log.Record();
  const std::vector<io::RunStage> earlier = io::ReadRunStages(options.set);
  record.stages.insert(record.stages.begin(), earlier.begin(), earlier.end());
  io::WriteRunRecord(writer.folder(), record);
  writer.Finish(set);
  return report;
}

}  // namespace dtr::pipeline
