#include "pipeline/core/depth/depth_engine.h"

#include <fmt/format.h>

#include "calib/colmap/dense.h"
#include "calib/colmap/export.h"
#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "pipeline/core/depth/depth_priors.h"
#include "stereo/colmap/colmap_engine.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

// Lays out a workspace of the source views and has COLMAP fill it. Images are called as their files
// in the set. Its world begins where the set's does: COLMAP computes depth in single precision,
// which at a national grid's millions of metres would leave steps of half a metre.
void ComputeWorkspace(const DepthSources& of, const fs::path& workspace, Progress& progress) {
  DtrSet set;
  set.frames.resize(1);
  for (const int source : of.sources) {
    const View& view = of.views[static_cast<size_t>(source)];
    const fs::path file = fs::path(view.image_file->path).filename();
    fs::create_directories(workspace / "images");
    CopyFileAtomically(of.set_folder / view.image_file->path, workspace / "images" / file);
    View bare;
    bare.id = view.id;
    bare.name = file.string();
    bare.camera = view.camera;
    bare.cam_from_world = view.cam_from_world;
    set.frames.front().views.push_back(std::move(bare));
  }
  colmap::WriteDenseWorkspace(workspace, colmap::ModelFromViews(set, *of.scene));
  colmap::RunPatchMatchStereo(workspace, progress);
}

std::unique_ptr<stereo::Engine> MakeColmapEngine(const fs::path& given, const DepthSources& of,
                                                 Progress& progress) {
  const fs::path workspace = given.empty() ? of.work_folder / "colmap" : given;
  if (given.empty()) ComputeWorkspace(of, workspace, progress);
  std::vector<std::string> names;
  for (const int source : of.sources) {
    const View& view = of.views[static_cast<size_t>(source)];
    names.push_back(given.empty() ? fs::path(view.image_file->path).filename().string()
                                  : view.name);
  }
  const Eigen::Vector3d world_origin =
      given.empty() ? Eigen::Vector3d::Zero().eval() : Eigen::Vector3d(of.world_origin);
  auto engine = std::make_unique<stereo::ColmapEngine>(workspace, names, of.stereo, world_origin);
  if (engine->photometric_maps() > 0) {
    progress.Note(
        fmt::format("colmap: {} of {} depth maps are photometric, not checked against each other "
                    "by COLMAP: their "
                    "geometric ones are not there",
                    engine->photometric_maps(), names.size()));
  }
  return engine;
}

}  // namespace

void RequireEngine(const DepthChoice& choice) {
  if (!choice.workspace.empty() && choice.engine != "colmap") {
    throw UsageError(
        fmt::format("`workspace`: is read by `engine` colmap, found `engine` {}", choice.engine));
  }
  if (choice.time_budget_s && choice.engine != "patchmatch") {
    throw UsageError(fmt::format("`time_budget`: picks settings of `engine` patchmatch, found {}",
                                 choice.engine));
  }
  if (choice.prior.given() && choice.engine != "patchmatch" && choice.engine != "prior") {
    throw UsageError(fmt::format(
        "`depth_prior`: starts `engine` patchmatch, or is the depth with `engine` prior; "
        "found `engine` {}",
        choice.engine));
  }
  if (choice.engine == "prior" && !choice.prior.given()) {
    throw UsageError("`engine` prior: takes the depth of `depth_prior`; give that folder");
  }
  if (choice.engine == "colmap" && choice.workspace.empty()) colmap::RequireCuda();
}

std::unique_ptr<stereo::Engine> MakeDepthEngine(const DepthChoice& choice,
                                                const stereo::QualitySettings& quality,
                                                const DepthSources& of, Progress& progress) {
  if (choice.engine == "none") return nullptr;
  if (choice.engine == "prior") return MakePriorEngine();
  if (choice.engine == "colmap") return MakeColmapEngine(choice.workspace, of, progress);
  return stereo::MakeEngine(choice.engine, quality);
}

}  // namespace dtr::pipeline
