#include "calib/sfm/run/sfm.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "calib/sfm/mapping/model_check.h"
#include "calib/sfm/mapping/triangulate.h"
#include "calib/sfm/run/colmap_steps.h"
#include "calib/sfm/run/own_mapping.h"
#include "calib/sfm/run/own_steps.h"
#include "calib/sfm/run/parallax.h"
#include "calib/sfm/run/point_colours.h"
#include "calib/sfm/run/sfm_steps.h"
#include "calib/sfm/run/without_camera.h"
#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/parallel_for.h"

namespace dtr::sfm {
namespace fs = std::filesystem;
namespace {

constexpr std::uintmax_t kLargestSizes = 1 << 20;

[[noreturn]] void ThrowNoModel(const Workspace& workspace, const MatchSummary& matches) {
  const std::string log = workspace.Report().steps.back().log_file.string();
  if (const std::string why = WhyNoModel(CountPairs(matches)); !why.empty()) {
    throw Error(fmt::format("colmap mapper: no model of {} photos: {}; see {}",
                            workspace.images().size(), why, log));
  }
  throw Error(fmt::format(
      "colmap mapper: expected a model of {} photos, found that they have too little in common to "
      "make one; photos must overlap by half and show texture; see {}",
      workspace.images().size(), log));
}

void MappingStep(Workspace& workspace, const std::vector<CameraGroup>& groups,
                 const SfmOptions& options) {
  for (const char* part : {"model", kForwardMotionNote, kFixedIntrinsicsNote, kOwnMappingNote}) {
    RemoveTree(workspace.folder() / part);
  }
  const std::vector<calib::SfmModel> made = options.engine == SfmEngine::kColmap
                                                ? options.colmap->Map(workspace, groups, options)
                                                : MapOrFallBack(workspace, groups, options);
  if (made.empty()) ThrowNoModel(workspace, MatchedIn(workspace, options));
  std::string sizes;
  for (const auto& model : made) sizes += fmt::format("{}\n", model.images.size());
  WriteFileAtomically(workspace.folder() / "models.txt", sizes);
  options.colmap->WriteModel(workspace.folder() / "model", made.front());
}

// Leaves no model where the mapper makes none.
void FixedMappingStep(Workspace& workspace, const std::vector<CameraGroup>& groups,
                      const SfmOptions& options) {
  const fs::path folder = workspace.folder() / kFixedModel;
  RemoveTree(folder);
  std::optional<calib::SfmModel> model;
  if (options.engine == SfmEngine::kColmap) {
    model = options.colmap->MapFixed(workspace, options);
  } else {
    GloballyMapped mapped = MapHere(workspace, options, LensesOf(workspace, groups));
    if (mapped.why_not.empty() && !mapped.model.images.empty()) model = std::move(mapped.model);
  }
  if (model) options.colmap->WriteModel(folder, *model);
}

// COLMAP's version is among the inputs of all steps where it made the features.
std::string MappingInputs(const SfmOptions& options) {
  std::string inputs = fmt::format("seed {}", options.seed);
  if (options.engine != SfmEngine::kColmap) inputs += fmt::format(" {}", NameOf(options.engine));
  if (options.intrinsics_are_known) inputs += " known intrinsics";
  if (options.engine == SfmEngine::kAuto) {
    const ColmapState colmap = options.colmap->Find();
    inputs += colmap.Works() ? " " + colmap.version : " without COLMAP";
  }
  return inputs;
}

std::vector<int> ModelSizes(const Workspace& workspace) {
  std::vector<int> sizes;
  const std::string text = ReadFile(workspace.folder() / "models.txt", kLargestSizes);
  int size = 0, used = 0;
  for (const char* at = text.c_str(); std::sscanf(at, "%d%n", &size, &used) == 1; at += used) {
    sizes.push_back(size);
  }
  return sizes;
}

}  // namespace

SfmResult RunSfm(const fs::path& images_dir, std::span<const SfmImageInput> images,
                 const fs::path& workspace_folder, const SfmOptions& options, Progress& progress,
                 const std::optional<SfmPart>& part) {
  const calib::CameraModel lens = CameraModelOf(options);
  if (images.size() < 2) {
    throw UsageError(
        fmt::format("{}: expected at least two photos, found {}; depth needs a second "
                    "position to look from",
                    images_dir.string(), images.size()));
  }
  Workspace workspace(workspace_folder, images_dir, images, "", progress, VersionOf(options),
                      options.folder_is_shared);
  const auto groups = GroupCameras(workspace.images(), lens, options.share_intrinsics_within_group);
  SfmResult result;
  FeaturesAndMatches(workspace, {groups, {}, options.intrinsics_are_known}, options, result.report,
                     part);
  if (part) return result;
  workspace.Step("mapping", MappingInputs(options),
                 [&] { MappingStep(workspace, groups, options); });
  result.model = options.colmap->ReadModel(workspace.folder() / "model");
  result.report.images_per_model = ModelSizes(workspace);
  result.report.fixed_intrinsics = fs::exists(workspace.folder() / kFixedIntrinsicsNote);
  result.report.forward_motion = fs::exists(workspace.folder() / kForwardMotionNote);
  CompleteReport(workspace, result.model, result.report);
  if (options.engine != SfmEngine::kColmap) {
    ReadOwnMappingNote(workspace, result.report);
    WriteReport(workspace.folder(), result.report);
  }
  if (options.folder_is_shared) return result;  // who is alone says what follows
  try {
    const MatchSummary matches = MatchedIn(workspace, options);
    const PairCounts pairs = CountPairs(matches);
    result.report.lack_of_parallax = LackOfParallax(pairs);
    if (result.report.lack_of_parallax.empty()) {
      result.report.lack_of_parallax = LackOfPairs(pairs);
    }
    // One homography explains most pairs of a wall or a box, too, of which there is a model: that
    // is worth a line where the model does not determine its cameras, not here.
    if (CameraStoodStill(pairs)) progress.Note(result.report.lack_of_parallax);
    auto why = WhyWithoutCamera(workspace, matches, result.model,
                                result.report.forward_motion ? kMinInliersForward : kMinInliers);
    result.report.why_not_registered.merge(why);
  } catch (const Error& error) {  // the model is whole: a diagnosis is not worth its loss
    progress.Note(
        fmt::format("parallax and photos without a camera cannot be analysed: {}", error.what()));
  }
  return result;
}

calib::SfmModel PointsOfMatches(const fs::path& images_dir, std::span<const SfmImageInput> images,
                                const fs::path& workspace_folder, const SfmOptions& options,
                                const calib::LensCamera& lens,
                                const std::map<std::string, Pose>& cam_from_world,
                                Progress& progress) {
  Workspace workspace(workspace_folder, images_dir, images, "", progress, VersionOf(options),
                      options.folder_is_shared);
  ViewGraph graph = ReadGraph(workspace);
  std::vector<Pose> poses;
  std::vector<bool> posed;
  for (const GraphImage& image : graph.images) {
    const auto found = cam_from_world.find(image.name);
    posed.push_back(found != cam_from_world.end());
    poses.push_back(posed.back() ? found->second : Pose{});
  }
  for (calib::LensCamera& camera : graph.cameras) camera = lens;
  std::erase_if(graph.pairs, [&](const PairGeometry& pair) {
    return !posed[static_cast<size_t>(pair.image_a)] || !posed[static_cast<size_t>(pair.image_b)];
  });
  calib::SfmModel model = TriangulateMatches(graph, poses);
  if (const std::string why = WhyRigsContradicted(graph, model); !why.empty()) {
    throw Error(fmt::format(
        "structure from motion: expected panoramas that determine their cameras, found that {}; "
        "panoramas must show the same things from several positions",
        why));
  }
  std::erase_if(model.images,
                [&](const calib::SfmImage& image) { return !cam_from_world.contains(image.name); });
  ColourPoints(workspace, model);
  return model;
}

std::optional<SfmResult> MapWithFixedIntrinsics(const fs::path& images_dir,
                                                std::span<const SfmImageInput> images,
                                                const fs::path& workspace_folder,
                                                const SfmOptions& options, Progress& progress) {
  Workspace workspace(workspace_folder, images_dir, images, "", progress, VersionOf(options),
                      options.folder_is_shared);
  const auto groups = GroupCameras(workspace.images(), CameraModelOf(options),
                                   options.share_intrinsics_within_group);
  if (!AllHavePriors(groups)) return {};
  SfmResult result;
  FeaturesAndMatches(workspace, {groups}, options, result.report);
  workspace.Step("mapping", MappingInputs(options),
                 [&] { MappingStep(workspace, groups, options); });
  workspace.Step("fixed mapping", MappingInputs(options),
                 [&] { FixedMappingStep(workspace, groups, options); });
  if (!fs::exists(workspace.folder() / kFixedModel)) return {};
  result.model = options.colmap->ReadModel(workspace.folder() / kFixedModel);
  result.report.images_per_model = {static_cast<int>(result.model.images.size())};
  result.report.fixed_intrinsics = true;
  CompleteReport(workspace, result.model, result.report);
  return result;
}

}  // namespace dtr::sfm
