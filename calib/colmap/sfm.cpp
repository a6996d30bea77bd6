#include "calib/colmap/sfm.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "calib/colmap/database.h"
#include "calib/colmap/graph_database.h"
#include "calib/colmap/model_io.h"
#include "calib/colmap/own_mapping.h"
#include "calib/colmap/own_steps.h"
#include "calib/colmap/parallax.h"
#include "calib/colmap/point_colours.h"
#include "calib/colmap/sfm_steps.h"
#include "calib/colmap/without_camera.h"
#include "calib/sfm/mapping/model_check.h"
#include "calib/sfm/mapping/triangulate.h"
#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/parallel_for.h"

namespace dtr::colmap {
namespace fs = std::filesystem;
namespace {

constexpr std::uintmax_t kLargestNote = 1 << 20;

// Images registered so far, from "Registering image #7 (3)" (3.8) and
// "Registering image #7 (num_reg_frames=3)" (later): the number in parentheses counts those before.
int RegisteredImages(const std::string& line) {
  if (line.find("Registering image #") == std::string::npos) return -1;
  const size_t open = line.find('(');
  if (open == std::string::npos) return -1;
  const size_t digits = line.find_first_of("0123456789", open);
  int count = 0;
  if (digits == std::string::npos || std::sscanf(line.c_str() + digits, "%d", &count) != 1) {
    return -1;
  }
  return count;
}

[[noreturn]] void ThrowNoModel(const Workspace& workspace) {
  const std::string log = workspace.Report().steps.back().log_file.string();
  if (const std::string why = WhyNoModel(CountPairs(workspace)); !why.empty()) {
    throw Error(fmt::format("colmap mapper: no model of {} photos: {}; see {}",
                            workspace.images().size(), why, log));
  }
  throw Error(fmt::format(
      "colmap mapper: expected a model of {} photos, found that they have too little in common to "
      "make one; photos must overlap by half and show texture; see {}",
      workspace.images().size(), log));
}

// How COLMAP maps.
enum class Mapping {
  kFree,
  kFixedIntrinsics,  ///< focal lengths of EXIF, no distortion
  kForwardMotion,    ///< with the thresholds of a walk straight ahead
};

// Runs the mapper; false where it found no two photos to start from, which COLMAP takes for an
// error: it is a finding about the photos.
bool Map(Workspace& workspace, const fs::path& models, std::uint64_t seed, Mapping mapping) {
  Arguments arguments(workspace.program(), "mapper");
  arguments.AddIfKnown({"random_seed", "default_random_seed"}, fmt::format("{}", seed))
      .AddIfKnown({"Mapper.random_seed"}, fmt::format("{}", seed))
      .Add({"database_path"}, workspace.database().string())
      .Add({"image_path"}, workspace.images_folder().string())
      .Add({"output_path"}, models.string())
      .Add({"Mapper.num_threads"}, std::to_string(workspace.threads()));
  if (mapping == Mapping::kForwardMotion) AllowForwardMotion(arguments);
  if (mapping == Mapping::kFixedIntrinsics) {
    arguments.Add({"Mapper.ba_refine_focal_length"}, "0")
        .Add({"Mapper.ba_refine_extra_params"}, "0");
  }
  workspace.progress().Stage("mapping", static_cast<int>(workspace.images().size()));
  int most = 0;
  bool no_pair = false;
  try {
    workspace.Run(arguments, [&](const std::string& line) {
      const int count = RegisteredImages(line);
      if (count > most) workspace.progress().Update(most = count);
      no_pair = no_pair || line.find("No good initial image pair") != std::string::npos ||
                line.find("failed to create sparse model") != std::string::npos ||
                line.find("failed to create any sparse model") != std::string::npos;
    });
  } catch (const Interrupted&) {
    throw;
  } catch (const Error&) {
    if (no_pair) return false;
    throw;
  }
  return true;
}

// The folders "0", "1", ... in which the mapper leaves its models, as models; largest first (by
// images, then points, then number).
std::vector<calib::SfmModel> ModelsIn(const Workspace& workspace, const fs::path& folder) {
  std::vector<calib::SfmModel> models;
  for (int i = 0; fs::is_directory(folder / std::to_string(i)); ++i) {
    models.push_back(workspace.ReadModelHere(folder / std::to_string(i)));
  }
  std::stable_sort(models.begin(), models.end(), [](const auto& a, const auto& b) {
    return std::pair(a.images.size(), a.points.size()) >
           std::pair(b.images.size(), b.points.size());
  });
  return models;
}

std::vector<calib::SfmModel> MadeIn(Workspace& workspace, const fs::path& models,
                                    const SfmOptions& options, Mapping mapping) {
  RemoveTree(models);
  MakeFolder(models);
  if (options.intrinsics_are_known && mapping == Mapping::kFree) {
    mapping = Mapping::kFixedIntrinsics;
  }
  return Map(workspace, models, options.seed, mapping) ? ModelsIn(workspace, models)
                                                       : std::vector<calib::SfmModel>();
}

// Every camera has a focal length of EXIF to be fixed at.
bool AllHavePriors(const std::vector<CameraGroup>& groups) {
  return std::none_of(groups.begin(), groups.end(),
                      [](const CameraGroup& group) { return group.params.empty(); });
}

size_t PhotosOf(const std::vector<calib::SfmModel>& made) {
  return made.empty() ? 0 : made.front().images.size();
}

// What the mapper makes of photos of which it made `free`, nothing or little, with free intrinsics;
// `free` where that is no more.
std::vector<calib::SfmModel> MadeOtherwise(Workspace& workspace, const fs::path& models,
                                           const std::vector<CameraGroup>& groups,
                                           const SfmOptions& options,
                                           std::vector<calib::SfmModel> free) {
  constexpr double kMaxPhotos = 0.75;
  std::vector<calib::SfmModel> fixed;
  if (AllHavePriors(groups)) {
    workspace.progress().Note(
        "COLMAP made no model with free focal lengths; trying with those of EXIF, fixed");
    fixed = MadeIn(workspace, models, options, Mapping::kFixedIntrinsics);
  }
  std::vector<calib::SfmModel> forward;
  if (static_cast<double>(PhotosOf(fixed)) <
      kMaxPhotos * static_cast<double>(workspace.images().size())) {
    workspace.progress().Note(
        "COLMAP found no two photos to start from; trying two that may lie in line with what they "
        "see");
    forward = MadeIn(workspace, models, options, Mapping::kForwardMotion);
  }
  const bool take_fixed = PhotosOf(fixed) > PhotosOf(forward);
  std::vector<calib::SfmModel>& made = take_fixed ? fixed : forward;
  if (!free.empty() && PhotosOf(made) <= PhotosOf(free)) return free;
  WriteFileAtomically(workspace.folder() / (take_fixed ? kFixedIntrinsicsNote : kForwardMotionNote),
                      "");
  return std::move(made);
}

std::vector<calib::SfmModel> MadeByColmap(Workspace& workspace,
                                          const std::vector<CameraGroup>& groups,
                                          const SfmOptions& options) {
  const fs::path models = workspace.folder() / "models";
  auto made = MadeIn(workspace, models, options, Mapping::kFree);
  // COLMAP 3.10 leaves the two photos that it began with, to which none could be added; 3.8
  // nothing.
  const bool none = PhotosOf(made) <= 2 && PhotosOf(made) < workspace.images().size();
  return none ? MadeOtherwise(workspace, models, groups, options, std::move(made)) : made;
}

void MappingStep(Workspace& workspace, const std::vector<CameraGroup>& groups,
                 const SfmOptions& options) {
  for (const char* part : {"model", kForwardMotionNote, kFixedIntrinsicsNote, kOwnMappingNote}) {
    RemoveTree(workspace.folder() / part);
  }
  const auto by_colmap = [&] { return MadeByColmap(workspace, groups, options); };
  const std::vector<calib::SfmModel> made =
      options.engine == SfmEngine::kColmap ? by_colmap()
                                           : MapOrFallBack(workspace, groups, options, by_colmap);
  if (made.empty()) ThrowNoModel(workspace);
  std::string sizes;
  for (const auto& model : made) sizes += fmt::format("{}\n", model.images.size());
  WriteFileAtomically(workspace.folder() / "models.txt", sizes);
  WriteModel(workspace.folder() / "model", made.front(), Format::kBinary);
}

// Leaves no model where the mapper makes none.
void FixedMappingStep(Workspace& workspace, const std::vector<CameraGroup>& groups,
                      const SfmOptions& options) {
  const fs::path models = workspace.folder() / "fixed" / "models",
                 model = workspace.folder() / kFixedModel;
  RemoveTree(model);
  if (options.engine != SfmEngine::kColmap) {
    const GloballyMapped mapped = MapHere(workspace, options, LensesOf(workspace, groups));
    if (mapped.why_not.empty() && !mapped.model.images.empty()) {
      WriteModel(model, mapped.model, Format::kBinary);
    }
    return;
  }
  const auto made = MadeIn(workspace, models, options, Mapping::kFixedIntrinsics);
  if (!made.empty()) WriteModel(model, made.front(), Format::kBinary);
}

// COLMAP's version is among the inputs of all steps where it made the features.
std::string MappingInputs(const SfmOptions& options) {
  std::string inputs = fmt::format("seed {}", options.seed);
  if (options.engine != SfmEngine::kColmap) inputs += fmt::format(" {}", NameOf(options.engine));
  if (options.intrinsics_are_known) inputs += " known intrinsics";
  if (options.engine == SfmEngine::kAuto) {
    const Program::State colmap = Program::Find();
    inputs += colmap.Works() ? " " + colmap.version : " without COLMAP";
  }
  return inputs;
}

std::vector<int> ModelSizes(const Workspace& workspace) {
  std::vector<int> sizes;
  const std::string text = ReadFile(workspace.folder() / "models.txt", kLargestNote);
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
  Workspace workspace(workspace_folder, images_dir, images, "", ResolveThreads(options.threads),
                      progress, options.engine, options.folder_is_shared);
  const auto groups = GroupCameras(workspace.images(), lens, options.share_intrinsics_within_group);
  SfmResult result;
  FeaturesAndMatches(workspace, {groups, {}, options.intrinsics_are_known}, options, result.report,
                     part);
  if (part) return result;
  workspace.Step("mapping", MappingInputs(options),
                 [&] { MappingStep(workspace, groups, options); });
  result.model = ReadModel(workspace.folder() / "model");
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
    const PairCounts pairs = CountPairs(workspace);
    result.report.lack_of_parallax = LackOfParallax(pairs);
    if (result.report.lack_of_parallax.empty()) {
      result.report.lack_of_parallax = LackOfPairs(pairs);
    }
    // One homography explains most pairs of a wall or a box, too, of which there is a model: that
    // is worth a line where the model does not determine its cameras, not here.
    if (CameraStoodStill(pairs)) progress.Note(result.report.lack_of_parallax);
    auto why = WhyWithoutCamera(workspace, result.model,
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
  Workspace workspace(workspace_folder, images_dir, images, "", ResolveThreads(options.threads),
                      progress, options.engine, options.folder_is_shared);
  sfm::ViewGraph graph = ReadViewGraph(workspace.database());
  std::vector<Pose> poses;
  std::vector<bool> posed;
  for (sfm::GraphImage& image : graph.images) {
    image.name = workspace.NameOfAlias(image.name);
    const auto found = cam_from_world.find(image.name);
    posed.push_back(found != cam_from_world.end());
    poses.push_back(posed.back() ? found->second : Pose{});
  }
  for (calib::LensCamera& camera : graph.cameras) camera = lens;
  std::erase_if(graph.pairs, [&](const sfm::PairGeometry& pair) {
    return !posed[static_cast<size_t>(pair.image_a)] || !posed[static_cast<size_t>(pair.image_b)];
  });
  calib::SfmModel model = sfm::TriangulateMatches(graph, poses, workspace.threads());
  if (const std::string why = sfm::WhyRigsContradicted(graph, model, workspace.threads());
      !why.empty()) {
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
  Workspace workspace(workspace_folder, images_dir, images, "", ResolveThreads(options.threads),
                      progress, options.engine, options.folder_is_shared);
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
  result.model = ReadModel(workspace.folder() / kFixedModel);
  result.report.images_per_model = {static_cast<int>(result.model.images.size())};
  result.report.fixed_intrinsics = true;
  CompleteReport(workspace, result.model, result.report);
  return result;
}

}  // namespace dtr::colmap
