#include "calib/colmap/steps.h"

#include <map>

#include "calib/colmap/database.h"
#include "calib/colmap/features.h"
#include "calib/colmap/matching.h"
#include "calib/colmap/model_io.h"
#include "calib/colmap/program.h"
#include "calib/sfm/run/parallax.h"
#include "dtr/base/delete.h"
#include "dtr/base/durable.h"
#include "dtr/base/files.h"

namespace dtr::colmap {
namespace fs = std::filesystem;
namespace {

constexpr std::uintmax_t kLargestStepNote = 1 << 12;

// Of TwoViewGeometry::ConfigurationType: one homography explains these.
constexpr int kFirstPlanar = 4, kLastPlanar = 7;

fs::path FeatureDatabaseOf(const sfm::Workspace& workspace) {
  return workspace.folder() / "features.db";
}

}  // namespace

sfm::ColmapState Steps::Find() const { return Program::Find(); }

std::string Steps::Version() const { return Program().version(); }

calib::SfmModel Steps::ReadModel(const fs::path& folder) const { return colmap::ReadModel(folder); }

void Steps::WriteModel(const fs::path& folder, const calib::SfmModel& model) const {
  colmap::WriteModel(folder, model, Format::kBinary);
  SyncFolder(folder);
}

void Steps::Extract(sfm::Workspace& workspace, const std::vector<sfm::CameraGroup>& groups,
                    const sfm::ExtractionPlan& plan, std::uint64_t seed) const {
  ExtractFeaturesResumably(workspace, FeatureDatabaseOf(workspace), groups, plan, seed);
}

void Steps::Match(sfm::Workspace& workspace, sfm::Matching matching, const sfm::SfmOptions& options,
                  const std::optional<sfm::ImagePairs>& allowed) const {
  const fs::path database = DatabaseOf(workspace);
  // Matching may take hours: an interrupted run of the same inputs goes on with its pairs.
  const fs::path begun = workspace.folder() / "matches.begun";
  const bool go_on = fs::exists(begun) && fs::exists(database) &&
                     ReadFile(begun, kLargestStepNote) == workspace.fingerprint();
  if (!go_on) {
    RemoveTree(begun);
    CopyDatabase(FeatureDatabaseOf(workspace), database);
    WriteFileAtomically(begun, workspace.fingerprint());
  }
  MatchPhotos(workspace, database, matching, options.memory_gb, options.seed, allowed);
}

sfm::MatchSummary Steps::Matched(const sfm::Workspace& workspace) const {
  const fs::path database = DatabaseOf(workspace);
  const auto ids = ReadDatabaseIds(database);
  std::map<std::uint32_t, size_t> photo_of;
  for (size_t i = 0; i < workspace.images().size(); ++i) {
    const auto found = ids.find(workspace.AliasOf(i));
    if (found != ids.end()) photo_of[found->second.image_id] = i;
  }
  sfm::MatchSummary summary;
  summary.features.resize(workspace.images().size());
  for (const auto& [id, features] : ReadFeatureCounts(database)) {
    const auto photo = photo_of.find(id);
    if (photo != photo_of.end()) summary.features[photo->second] = features;
  }
  ForEachMatchedPair(database, [&](const MatchedPair& pair) {
    const auto a = photo_of.find(pair.image_ids[0]), b = photo_of.find(pair.image_ids[1]);
    if (a == photo_of.end() || b == photo_of.end()) return;
    summary.pairs.push_back({a->second, b->second, static_cast<std::int64_t>(pair.moved_px.size()),
                             pair.config >= kFirstPlanar && pair.config <= kLastPlanar,
                             sfm::AreStill(pair.moved_px, workspace.images()[a->second])});
  });
  return summary;
}

}  // namespace dtr::colmap
