#include "calib/colmap/steps.h"

#include <map>

#include "calib/colmap/database.h"
#include "calib/colmap/features.h"
#include "calib/colmap/graph_database.h"
#include "calib/colmap/mapper.h"
#include "calib/colmap/matching.h"
#include "calib/colmap/model_io.h"
#include "calib/colmap/placement.h"
#include "calib/colmap/program.h"
#include "calib/colmap/workspace_files.h"
#include "calib/sfm/run/own_steps.h"
#include "calib/sfm/run/parallax.h"
#include "dtr/base/delete.h"
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

class ProgramSteps final : public sfm::ColmapSteps {
 public:
  sfm::ColmapState Find() const override { return Program::Find(); }
  std::string Version() const override { return Program().version(); }
  calib::SfmModel ReadModel(const fs::path& folder) const override {
    return colmap::ReadModel(folder);
  }
  void WriteModel(const fs::path& folder, const calib::SfmModel& model) const override {
    colmap::WriteModel(folder, model, Format::kBinary);
  }

  void Extract(sfm::Workspace& workspace, const std::vector<sfm::CameraGroup>& groups,
               const sfm::ExtractionPlan& plan, std::uint64_t seed) const override {
    Program program;
    ExtractFeaturesResumably(program, workspace, FeatureDatabaseOf(workspace), groups, plan, seed);
  }

  void Match(sfm::Workspace& workspace, sfm::Matching matching, const sfm::SfmOptions& options,
             const std::optional<sfm::ImagePairs>& allowed) const override {
    Program program;
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
    MatchPhotos(program, workspace, database, matching, options.memory_gb, options.seed, allowed);
  }

  sfm::MatchSummary Matched(const sfm::Workspace& workspace) const override {
    const fs::path database = DatabaseOf(workspace);
    const auto ids = ReadDatabaseIds(database);
    std::map<std::uint32_t, size_t> photo_of;
    for (size_t i = 0; i < workspace.images().size(); ++i) {
      const auto found = ids.find(workspace.AliasOf(i));
      if (found != ids.end()) photo_of[found->second.image_id] = i;
    }
    sfm::MatchSummary summary;
    summary.features.resize(workspace.images().size());
    for (const auto& [id, features] : ReadDatabaseMatches(database).features) {
      const auto photo = photo_of.find(id);
      if (photo != photo_of.end()) summary.features[photo->second] = features;
    }
    ForEachMatchedPair(database, [&](const MatchedPair& pair) {
      const auto a = photo_of.find(pair.image_ids[0]), b = photo_of.find(pair.image_ids[1]);
      if (a == photo_of.end() || b == photo_of.end()) return;
      summary.pairs.push_back({a->second, b->second,
                               static_cast<std::int64_t>(pair.moved_px.size()),
                               pair.config >= kFirstPlanar && pair.config <= kLastPlanar,
                               sfm::AreStill(pair.moved_px, workspace.images()[a->second])});
    });
    return summary;
  }

  std::vector<calib::SfmModel> Map(sfm::Workspace& workspace,
                                   const std::vector<sfm::CameraGroup>& groups,
                                   const sfm::SfmOptions& options) const override {
    if (options.engine == sfm::SfmEngine::kColmap) return MapByColmap(workspace, groups, options);
    const fs::path database = DatabaseOf(workspace);
    sfm::ViewGraph graph = sfm::ReadGraph(workspace);
    for (size_t i = 0; i < graph.images.size(); ++i) graph.images[i].name = workspace.AliasOf(i);
    WriteGraphDatabase(database, graph, sfm::FeatureFile(workspace.folder() / sfm::kFeatureFile));
    try {
      auto models = MapByColmap(workspace, groups, options);
      RemoveDatabase(database);
      return models;
    } catch (...) {
      RemoveDatabase(database);
      throw;
    }
  }
  std::optional<calib::SfmModel> MapFixed(sfm::Workspace& workspace,
                                          const sfm::SfmOptions& options) const override {
    return MapFixedByColmap(workspace, options);
  }
  calib::SfmModel Triangulate(sfm::Workspace& workspace, const calib::SfmModel& posed,
                              const sfm::SfmOptions& options) const override {
    return TriangulateByColmap(workspace, posed, options);
  }
  void Register(sfm::Workspace& workspace, const sfm::RegistrationInput& input,
                const std::vector<sfm::CameraGroup>& groups, const sfm::ExtractionPlan& plan,
                const sfm::SfmOptions& options, const fs::path& registered) const override {
    RegisterByColmap(workspace, input, groups, plan, options, registered);
  }
};

}  // namespace

const sfm::ColmapSteps& Steps() {
  static const ProgramSteps steps;
  return steps;
}

}  // namespace dtr::colmap
