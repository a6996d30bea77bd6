#include "pipeline/evaluate/evaluate_depth.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <vector>

#include "calib/similarity.h"
#include "dtr/base/error.h"
#include "dtr/eval/visibility.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/foreign_depth.h"
#include "dtr/io/image_io.h"
#include "pipeline/evaluate/detail/cast_truth.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

struct Pair {
  const View* view;
  const io::NamedCamera* truth;
};

std::vector<Pair> PairByName(const DtrSet& set, const io::CameraList& truth,
                             const fs::path& folder) {
  std::map<std::string, const io::NamedCamera*> by_name;
  for (const io::NamedCamera& camera : truth.cameras) by_name[camera.name] = &camera;
  std::vector<Pair> pairs;
  for (const View& view : set.frames.front().views) {
    const auto found = by_name.find(view.name);
    if (found != by_name.end()) pairs.push_back({&view, found->second});
  }
  if (pairs.empty()) {
    throw Error(
        fmt::format("{}: expected true cameras of the set's views by name, found none of {}",
                    (folder / "cameras.json").string(), set.frames.front().views.size()));
  }
  return pairs;
}

// Set units per unit of the truth. Cameras that agree to this share of their spread are the same.
constexpr double kSameCameras = 1e-6;

double ScaleFromTruth(const DtrSet& set, const io::CameraList& truth,
                      const std::vector<Pair>& pairs, Progress& progress) {
  std::vector<Eigen::Vector3d> in_truth, in_set;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double largest_move = 0, spread = 0;
  for (const Pair& pair : pairs) {
    in_truth.push_back(pair.truth->cam_from_world.TargetOriginInSource());
    in_set.push_back(pair.view->CenterInWorld() + (set.world_origin - truth.world_origin));
    mean += in_set.back() / static_cast<double>(pairs.size());
    largest_move = std::max(largest_move, (in_set.back() - in_truth.back()).norm());
  }
  for (const Eigen::Vector3d& center : in_set) spread = std::max(spread, (center - mean).norm());
  if (largest_move <= kSameCameras * spread) return 1;

  const calib::Similarity set_from_truth = calib::AlignPoints(in_truth, in_set);
  progress.Note(
      fmt::format("truth aligned with the set by {} camera centres: scale {:.6g}, residual {:.3g} "
                  "% of the spread",
                  pairs.size(), set_from_truth.scale,
                  100 * calib::AlignmentRms(set_from_truth, in_truth, in_set) / spread));
  return set_from_truth.scale;
}

// What counts: masks written beside the truth, where they exist; both must let a pixel through.
Mask ScoredPixels(const fs::path& folder, const std::string& stem, int width_px, int height_px) {
  Mask scored(width_px, height_px, 1, 255);
  for (const char* kind : {"visible", "texture"}) {
    const fs::path file = folder / "masks" / fmt::format("{}_{}.png", stem, kind);
    if (!fs::exists(file)) continue;
    const Mask mask = io::ReadMask(file);
    if (mask.width() != width_px || mask.height() != height_px) {
      throw Error(fmt::format("{}: expected {}x{}, found {}x{}", file.string(), width_px, height_px,
                              mask.width(), mask.height()));
    }
    for (size_t i = 0; i < scored.data().size(); ++i) scored.data()[i] &= mask.data()[i];
  }
  return scored;
}

// Truth as it lies on disk, which must be on the view's grid.
ViewTruth StoredTruth(const fs::path& folder, const io::NamedCamera& named, const View& view) {
  eval::RequireSameGrid(named.camera, view.camera, view.name);
  const int width_px = view.camera.width_px(), height_px = view.camera.height_px();
  return {ToPlaneZ(io::ReadForeignDepth(folder / "depth" / named.depth_file, named.depth_kind, 1,
                                        width_px, height_px),
                   view.camera),
          ScoredPixels(folder, fs::path(view.name).stem().string(), width_px, height_px)};
}

}  // namespace

void ScoreDepth(const DtrSet& set, const fs::path& truth, Progress& progress, DepthScorers* scorers,
                const std::function<void(const View&, const ScoredDepth&)>& on_view) {
  const io::CameraList list = io::ReadCamerasJson(truth / "cameras.json");
  const std::vector<Pair> pairs = PairByName(set, list, truth);
  const double scale = ScaleFromTruth(set, list, pairs, progress);
  const auto cast = CastTruth::FromFolder(truth, list);
  progress.Stage("scoring depth", static_cast<int>(pairs.size()));
  int done = 0;
  for (const Pair& pair : pairs) {
    progress.ThrowIfInterrupted();
    const View& view = *pair.view;
    if (view.role != ViewRole::kSource) continue;
    const PinholeCamera camera = view.DepthCamera();
    // A view that got no depth at all has missed every true pixel of it.
    const DepthImage none(camera.width_px(), camera.height_px());
    const DepthImage depth = view.depth.empty() ? none : MeasuredDepth(view);
    const ViewTruth found =
        cast && !eval::IsSameGrid(pair.truth->camera, view.camera)
            ? cast->On(view, static_cast<size_t>(pair.truth - list.cameras.data()))
            : StoredTruth(truth, *pair.truth, view);
    const DepthImage truth_there = eval::SubsampleTruth(found.depth, view.depth_scale);
    const Mask scored = eval::SubsampleMask(found.scored, view.depth_scale);
    if (!view.depth_state.empty())
      scorers->completed.Add(CompletedDepth(view), truth_there, {}, scale, 0);
    scorers->measured.Add(depth, truth_there, scored, scale,
                          camera.fx_px() * view.reference_baseline,
                          view.inverse_depth_sigma ? &*view.inverse_depth_sigma : nullptr);
    if (on_view) on_view(view, {depth, truth_there, scored});
    progress.Update(++done);
  }
}

eval::DepthScores ScoresOf(const DepthScorers& scorers) {
  eval::DepthScores scores = scorers.measured.Scores();
  const eval::DepthScores completed = scorers.completed.Scores();
  scores.completed_pixels = completed.kept_pixels;
  if (completed.outlier_share_5pct) {
    scores.completed_share_within_5pct = 1 - *completed.outlier_share_5pct;
  }
  return scores;
}

eval::DepthScores EvaluateDepth(const DtrSet& set, const fs::path& truth, Progress& progress) {
  DepthScorers scorers;
  ScoreDepth(set, truth, progress, &scorers, {});
  return ScoresOf(scorers);
}

}  // namespace dtr::pipeline
