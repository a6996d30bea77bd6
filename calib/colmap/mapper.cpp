#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "calib/colmap/graph_database.h"
#include "calib/colmap/program.h"
#include "calib/colmap/steps.h"
#include "calib/sfm/run/own_steps.h"
#include "calib/sfm/run/sfm_steps.h"
#include "calib/sfm/run/store.h"
#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/parallel_for.h"

namespace dtr::colmap {
namespace fs = std::filesystem;
namespace {

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

// How COLMAP maps.
enum class Mapping {
  kFree,
  kFixedIntrinsics,  ///< focal lengths of EXIF, no distortion
  kForwardMotion,    ///< with the thresholds of a walk straight ahead
};

// Runs the mapper; false where it found no two photos to start from, which COLMAP takes for an
// error: it is a finding about the photos.
bool RunMapper(sfm::Workspace& workspace, const fs::path& models, std::uint64_t seed,
               Mapping mapping) {
  Arguments arguments("mapper");
  arguments.AddIfKnown({"random_seed", "default_random_seed"}, fmt::format("{}", seed))
      .AddIfKnown({"Mapper.random_seed"}, fmt::format("{}", seed))
      .Add({"database_path"}, DatabaseOf(workspace).string())
      .Add({"image_path"}, workspace.images_folder().string())
      .Add({"output_path"}, models.string())
      .Add({"Mapper.num_threads"}, std::to_string(ThreadLimit::Current()));
  if (mapping == Mapping::kForwardMotion) AllowForwardMotion(arguments);
  if (mapping == Mapping::kFixedIntrinsics) {
    arguments.Add({"Mapper.ba_refine_focal_length"}, "0")
        .Add({"Mapper.ba_refine_extra_params"}, "0");
  }
  workspace.progress().Stage("mapping", static_cast<int>(workspace.images().size()));
  int most = 0;
  bool no_pair = false;
  try {
    RunStep(workspace, arguments, [&](const std::string& line) {
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
std::vector<calib::SfmModel> ModelsIn(const sfm::Workspace& workspace, const fs::path& folder) {
  std::vector<calib::SfmModel> models;
  for (int i = 0; fs::is_directory(folder / std::to_string(i)); ++i) {
    models.push_back(ReadModelHere(workspace, folder / std::to_string(i)));
  }
  std::stable_sort(models.begin(), models.end(), [](const auto& a, const auto& b) {
    return std::pair(a.images.size(), a.points.size()) >
           std::pair(b.images.size(), b.points.size());
  });
  return models;
}

std::vector<calib::SfmModel> MadeIn(sfm::Workspace& workspace, const fs::path& models,
                                    const sfm::SfmOptions& options, Mapping mapping) {
  RemoveTree(models);
  sfm::MakeFolder(models);
  if (options.intrinsics_are_known && mapping == Mapping::kFree) {
    mapping = Mapping::kFixedIntrinsics;
  }
  return RunMapper(workspace, models, options.seed, mapping) ? ModelsIn(workspace, models)
                                                             : std::vector<calib::SfmModel>();
}

size_t PhotosOf(const std::vector<calib::SfmModel>& made) {
  return made.empty() ? 0 : made.front().images.size();
}

// What the mapper makes of photos of which it made `free`, nothing or little, with free intrinsics;
// `free` where that is no more.
std::vector<calib::SfmModel> MadeOtherwise(sfm::Workspace& workspace, const fs::path& models,
                                           const std::vector<sfm::CameraGroup>& groups,
                                           const sfm::SfmOptions& options,
                                           std::vector<calib::SfmModel> free) {
  constexpr double kMaxPhotos = 0.75;
  std::vector<calib::SfmModel> fixed;
  if (sfm::AllHavePriors(groups)) {
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
  WriteFileAtomically(
      workspace.folder() / (take_fixed ? sfm::kFixedIntrinsicsNote : sfm::kForwardMotionNote), "");
  return std::move(made);
}

// Makes a database of the workspace's features and matches for as long as it lives, where COLMAP
// did not make it.
class MappedDatabase {
 public:
  MappedDatabase(const sfm::Workspace& workspace, const sfm::SfmOptions& options) {
    if (options.engine == sfm::SfmEngine::kColmap) return;
    sfm::ViewGraph graph = sfm::ReadGraph(workspace);
    for (size_t i = 0; i < graph.images.size(); ++i) graph.images[i].name = workspace.AliasOf(i);
    made_ = DatabaseOf(workspace);
    WriteGraphDatabase(made_, graph, sfm::FeatureFile(workspace.folder() / sfm::kFeatureFile));
  }
  ~MappedDatabase() {
    if (!made_.empty()) TryRemoveFile(made_);
  }

 private:
  fs::path made_;
};

}  // namespace

std::vector<calib::SfmModel> Steps::Map(sfm::Workspace& workspace,
                                        const std::vector<sfm::CameraGroup>& groups,
                                        const sfm::SfmOptions& options) const {
  const MappedDatabase database(workspace, options);
  const fs::path models = workspace.folder() / "models";
  auto made = MadeIn(workspace, models, options, Mapping::kFree);
  // COLMAP 3.10 leaves the two photos that it began with, to which none could be added; 3.8
  // nothing.
  const bool none = PhotosOf(made) <= 2 && PhotosOf(made) < workspace.images().size();
  return none ? MadeOtherwise(workspace, models, groups, options, std::move(made)) : made;
}

std::optional<calib::SfmModel> Steps::MapFixed(sfm::Workspace& workspace,
                                               const sfm::SfmOptions& options) const {
  auto made = MadeIn(workspace, workspace.folder() / "fixed" / "models", options,
                     Mapping::kFixedIntrinsics);
  if (made.empty()) return std::nullopt;
  return std::move(made.front());
}

}  // namespace dtr::colmap
