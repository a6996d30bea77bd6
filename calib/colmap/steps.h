// calib/colmap/steps.h -- COLMAP for structure from motion.
#pragma once
#include "calib/sfm/run/colmap_steps.h"

namespace dtr::colmap {

/// By the `colmap` on the PATH.
class Steps final : public sfm::ColmapSteps {
 public:
  sfm::ColmapState Find() const override;
  std::string Version() const override;
  calib::SfmModel ReadModel(const std::filesystem::path& folder) const override;
  void WriteModel(const std::filesystem::path& folder, const calib::SfmModel& model) const override;
  void Extract(sfm::Workspace& workspace, const std::vector<sfm::CameraGroup>& groups,
               const sfm::ExtractionPlan& plan, std::uint64_t seed) const override;
  void Match(sfm::Workspace& workspace, sfm::Matching matching, const sfm::SfmOptions& options,
             const std::optional<sfm::ImagePairs>& allowed) const override;
  sfm::MatchSummary Matched(const sfm::Workspace& workspace) const override;
  std::vector<calib::SfmModel> Map(sfm::Workspace& workspace,
                                   const std::vector<sfm::CameraGroup>& groups,
                                   const sfm::SfmOptions& options) const override;
  std::optional<calib::SfmModel> MapFixed(sfm::Workspace& workspace,
                                          const sfm::SfmOptions& options) const override;
  calib::SfmModel Triangulate(sfm::Workspace& workspace, const calib::SfmModel& posed,
                              const sfm::SfmOptions& options) const override;
  void Register(sfm::Workspace& workspace, const sfm::RegistrationInput& input,
                const std::vector<sfm::CameraGroup>& groups, const sfm::ExtractionPlan& plan,
                const sfm::SfmOptions& options,
                const std::filesystem::path& registered) const override;
};
inline const Steps kSteps;

}  // namespace dtr::colmap
