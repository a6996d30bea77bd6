#include "calib/colmap/features.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/colmap/database.h"
#include "dtr/base/delete.h"
#include "dtr/base/durable.h"
#include "dtr/base/error.h"

namespace dtr::colmap {
namespace {

// COLMAP skips what it cannot read and ends with 0.
void ExpectInDatabase(const sfm::Workspace& workspace, const std::filesystem::path& database,
                      const std::vector<size_t>& images) {
  const auto ids = ReadDatabaseIds(database);
  for (const size_t i : images) {
    if (ids.contains(workspace.AliasOf(i))) continue;
    throw Error(
        fmt::format("{}: expected a photo that colmap feature_extractor can read, found that "
                    "it left the file out; convert it to JPEG or PNG",
                    workspace.images()[i].name));
  }
}

// The camera that the database has of photos of a group already.
std::optional<std::uint32_t> CameraOf(const sfm::Workspace& workspace,
                                      const std::filesystem::path& database,
                                      const sfm::CameraGroup& group) {
  const auto ids = ReadDatabaseIds(database);
  const auto known = ids.find(workspace.AliasOf(group.images.front()));
  return known == ids.end() ? std::nullopt : std::optional(known->second.camera_id);
}

// `camera_id`: the group's in the database, where it has one.
Arguments ExtractorArguments(sfm::Workspace& workspace, const std::filesystem::path& database,
                             const sfm::CameraGroup& group, const ExtractionRun& run,
                             std::optional<std::uint32_t> camera_id,
                             const sfm::ExtractionPlan& plan, std::uint64_t seed) {
  std::vector<std::string> names;
  for (const size_t i : run.images) names.push_back(workspace.AliasOf(i));
  const auto list =
      workspace.WriteList(fmt::format("camera_{:04}_{:06}.txt", run.group, run.images[0]), names);
  Arguments arguments("feature_extractor");
  arguments.AddIfKnown({"random_seed", "default_random_seed"}, fmt::format("{}", seed))
      .Add({"database_path"}, database.string())
      .Add({"image_path"}, workspace.images_folder().string())
      .Add({"image_list_path"}, list.string())
      .Add({"ImageReader.camera_model"}, calib::NameOf(group.model))
      .Add({"SiftExtraction.use_gpu", "FeatureExtraction.use_gpu"}, "0")
      .Add({"SiftExtraction.num_threads", "FeatureExtraction.num_threads"},
           std::to_string(std::min<size_t>(static_cast<size_t>(plan.threads), names.size())))
      .Add({"SiftExtraction.max_image_size", "FeatureExtraction.max_image_size"},
           std::to_string(plan.max_image_size_px));
  if (plan.max_features > 0) {
    arguments.Add({"SiftExtraction.max_num_features"}, std::to_string(plan.max_features));
  }
  const bool masked = std::any_of(run.images.begin(), run.images.end(), [&](size_t i) {
    return !workspace.images()[i].mask_file.empty();
  });
  if (masked) arguments.Add({"ImageReader.mask_path"}, workspace.masks_folder().string());
  if (camera_id) {
    arguments.Add({"ImageReader.existing_camera_id"}, std::to_string(*camera_id));
    return arguments;
  }
  arguments.Add({"ImageReader.single_camera"}, "1");
  if (!group.params.empty()) {
    arguments.Add({"ImageReader.camera_params"}, sfm::ParamsText(group.params));
  }
  return arguments;
}

size_t PhotosIn(const std::vector<ExtractionRun>& batch) {
  size_t count = 0;
  for (const ExtractionRun& run : batch) count += run.images.size();
  return count;
}

// `before`: photos of the groups whose features the database holds already.
void ExtractBatch(sfm::Workspace& workspace, const std::filesystem::path& database,
                  const std::vector<sfm::CameraGroup>& groups,
                  const std::vector<ExtractionRun>& batch, const sfm::ExtractionPlan& plan,
                  std::uint64_t seed, size_t before) {
  int done = static_cast<int>(before);
  for (const ExtractionRun& run : batch) {
    const sfm::CameraGroup& group = groups[run.group];
    auto camera_id = group.camera_id;
    if (!camera_id && before > 0) camera_id = CameraOf(workspace, database, group);
    RunStep(workspace, ExtractorArguments(workspace, database, group, run, camera_id, plan, seed),
            [&](const std::string& line) {
              if (line.find("Processed file [") != std::string::npos) {
                workspace.progress().Update(++done);
              }
            });
    ExpectInDatabase(workspace, database, run.images);
  }
}

}  // namespace

std::vector<std::vector<ExtractionRun>> InBatches(const std::vector<sfm::CameraGroup>& groups) {
  std::vector<std::vector<ExtractionRun>> batches;
  size_t before = 0, in_batch = 0, limit = 0;
  for (size_t g = 0; g < groups.size(); ++g) {
    for (const size_t i : groups[g].images) {
      if (in_batch == limit) {
        before += in_batch;
        in_batch = 0;
        limit = std::max(sfm::kPhotosPerBatch, before / 4);
        batches.emplace_back();
      }
      auto& batch = batches.back();
      if (batch.empty() || batch.back().group != g) batch.push_back({g, {}});
      batch.back().images.push_back(i);
      ++in_batch;
    }
  }
  return batches;
}

void ExtractFeatures(sfm::Workspace& workspace, const std::filesystem::path& database,
                     const std::vector<sfm::CameraGroup>& groups, const sfm::ExtractionPlan& plan,
                     std::uint64_t seed) {
  workspace.progress().Stage("features", static_cast<int>(workspace.images().size()));
  size_t before = 0;
  for (const auto& batch : InBatches(groups)) {
    ExtractBatch(workspace, database, groups, batch, plan, seed, before);
    before += PhotosIn(batch);
  }
}

void ExtractFeaturesResumably(sfm::Workspace& workspace, const std::filesystem::path& database,
                              const std::vector<sfm::CameraGroup>& groups,
                              const sfm::ExtractionPlan& plan, std::uint64_t seed) {
  const std::filesystem::path working = database.string() + ".working",
                              note = database.string() + ".begun";
  const size_t kept = std::filesystem::exists(database) ? workspace.Kept(note).value_or(0) : 0;
  if (kept == 0) {
    // A note must never meet features of other photos: it goes before a new database comes.
    RemoveTree(note);
    SyncFolder(note.parent_path());
    RemoveDatabase(database);  // COLMAP would take over what it holds
  }
  workspace.progress().Stage("features", static_cast<int>(workspace.images().size()));
  size_t before = 0;
  for (const auto& batch : InBatches(groups)) {
    const size_t after = before + PhotosIn(batch);
    if (after <= kept) {
      workspace.progress().Update(static_cast<int>(after));
    } else {
      // COLMAP writes photo by photo, and cameras before their photos: what it leaves when it is
      // stopped is thrown away, and only whole batches go on.
      before == 0 ? RemoveDatabase(working) : CopyDatabase(database, working);
      ExtractBatch(workspace, working, groups, batch, plan, seed, before);
      MoveDatabase(working, database);
      workspace.Keep(note, after);
    }
    before = after;
  }
  for (const sfm::CameraGroup& group : groups) ExpectInDatabase(workspace, database, group.images);
}

}  // namespace dtr::colmap
