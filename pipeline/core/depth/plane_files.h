// pipeline/core/depth/plane_files.h -- what a run keeps between its steps, as files.
#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "stereo/engine.h"
#include "stereo/plane_map.h"
#include "stereo/view_paging.h"

namespace dtr::pipeline {

/// Planes: one file (grid_files.h) per pass and view in a folder of working files: an interrupted
/// run goes on where it stopped, and memory holds only the planes in use. Load throws Error naming
/// the file when it is not what Save writes; so do Has and Drop where the folder cannot be read or
/// a file not removed.
class PlaneFiles final : public stereo::PlaneMapStore {
 public:
  /// Creates the folder. `made_from`: one line that says what the planes are computed from; planes
  /// of anything else are removed or, where other processes share the folder, rejected with Error.
  PlaneFiles(const std::filesystem::path& folder, const std::string& made_from,
             bool is_shared = false);
  bool Has(int pass, int view) const override;
  std::shared_ptr<const stereo::PlaneMap> Load(int pass, int view) override;
  void Save(int pass, int view, stereo::PlaneMap&& map) override;
  void Drop(int pass) override;

  /// The depth ranges that the planes lie in, which are kept beside them.
  void SaveRanges(std::span<const stereo::DepthRange> ranges);
  /// Nothing where there are none of so many views, or none that can be.
  std::optional<std::vector<stereo::DepthRange>> LoadRanges(size_t views) const;

 private:
  std::filesystem::path File(int pass, int view) const;
  std::filesystem::path folder_;
};

/// Unfiltered depth maps: one file per view. They belong to one run; those of an interrupted one
/// are not looked at.
class EstimateFiles final : public stereo::EstimateStore {
 public:
  /// Creates the folder and empties it.
  explicit EstimateFiles(const std::filesystem::path& folder);
  bool Has(int view) const override;
  std::shared_ptr<const stereo::DepthEstimate> Load(int view) override;
  void Save(int view, stereo::DepthEstimate&& estimate) override;
  void Drop(int view) override;

 private:
  std::filesystem::path File(int view) const;
  std::filesystem::path folder_;
};

}  // namespace dtr::pipeline
