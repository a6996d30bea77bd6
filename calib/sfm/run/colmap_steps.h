// calib/sfm/run/colmap_steps.h -- what the `colmap` program does of structure from motion.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/sfm/run/feature_plan.h"
#include "calib/sfm/run/match_summary.h"
#include "calib/sfm/run/workspace.h"
#include "calib/sfm_model.h"

namespace dtr::sfm {

/// A `colmap` program, without a throw.
struct ColmapState {
  std::string version;  ///< of one that works
  std::string why_not;  ///< one line of one that does not; empty where there is none
  bool Works() const { return !version.empty(); }
};

/// The model that a photo is registered in.
struct RegistrationInput {
  std::filesystem::path workspace;  ///< in which it was made
  const calib::SfmModel& model;
  std::vector<std::string> aliases;   ///< of its images, in their order
  std::vector<std::string> partners;  ///< aliases of the photos to match with
  bool forward_motion = false;        ///< its mapper needed other thresholds
};

/// COLMAP as calib/sfm/run sees it; calib/colmap/steps.h has it. All throw Error, as the program
/// and its files are found. Several threads may use one.
class ColmapSteps {
 public:
  virtual ~ColmapSteps() = default;

  virtual ColmapState Find() const = 0;
  /// Throws where there is none that works.
  virtual std::string Version() const = 0;

  /// Models in COLMAP's format, in which all are frozen; on the disk when this returns.
  virtual calib::SfmModel ReadModel(const std::filesystem::path& folder) const = 0;
  virtual void WriteModel(const std::filesystem::path& folder,
                          const calib::SfmModel& model) const = 0;

  /// These work in the workspace's database. Extract and Match go on where an interrupted call of
  /// the same step ended.
  virtual void Extract(Workspace& workspace, const std::vector<CameraGroup>& groups,
                       const ExtractionPlan& plan, std::uint64_t seed) const = 0;
  virtual void Match(Workspace& workspace, Matching matching, const SfmOptions& options,
                     const std::optional<ImagePairs>& allowed) const = 0;
  virtual MatchSummary Matched(const Workspace& workspace) const = 0;
  /// Models, largest first. With another engine than kColmap, of the workspace's features and
  /// matches (store.h), of which a database is made for as long as this takes.
  virtual std::vector<calib::SfmModel> Map(Workspace& workspace,
                                           const std::vector<CameraGroup>& groups,
                                           const SfmOptions& options) const = 0;
  /// With focal lengths fixed at the priors and no distortion; none: it makes no model so.
  virtual std::optional<calib::SfmModel> MapFixed(Workspace& workspace,
                                                  const SfmOptions& options) const = 0;
  /// Points of images with cameras and poses, which are held fixed; images without points may lack.
  virtual calib::SfmModel Triangulate(Workspace& workspace, const calib::SfmModel& posed,
                                      const SfmOptions& options) const = 0;
  /// A model of the only photo of `groups`, and others, in the folder `registered`, which is not
  /// there yet.
  virtual void Register(Workspace& workspace, const RegistrationInput& input,
                        const std::vector<CameraGroup>& groups, const ExtractionPlan& plan,
                        const SfmOptions& options,
                        const std::filesystem::path& registered) const = 0;
};

}  // namespace dtr::sfm
