// stereo/colmap/colmap_engine.h -- depth maps that COLMAP computed of the same cameras.
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "stereo/engine.h"

namespace dtr::stereo {

/// Reads the depth maps of a COLMAP dense workspace instead of computing any. The maps are held to
/// each other by ComputeDepthMaps as those of every engine. They carry no uncertainty: sigma is
/// half a pixel of disparity over the median baseline of the neighbours.
class ColmapEngine final : public Engine {
 public:
  /// `names` and `views`: those that ComputeDepthMaps will be given, poses relative to
  /// `world_origin`; pixels are not read here. An image of the workspace is a view's by its name
  /// or, where only one view has it, by its name without extension.
  /// Throws Error when a view has no image there, or one of another size, focal length, principal
  /// point or pose: its depths would not be this view's.
  ColmapEngine(const std::filesystem::path& workspace, std::span<const std::string> names,
               std::span<const StereoView> views, const Eigen::Vector3d& world_origin);

  std::string name() const override { return "colmap"; }
  bool Searches() const override { return false; }
  /// The map of the reference. Throws NoUsablePair when the workspace has none.
  DepthEstimate Estimate(std::span<const StereoView> views, int reference,
                         std::span<const int> neighbours, const DepthRange& range,
                         const EngineOptions& options) const override;

  /// Maps taken that COLMAP did not hold to each other.
  int photometric_maps() const { return photometric_maps_; }

 private:
  std::vector<std::filesystem::path> maps_;  ///< one per view; empty where there is none
  int photometric_maps_ = 0;
};

}  // namespace dtr::stereo
