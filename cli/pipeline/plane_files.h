// cli/pipeline/plane_files.h -- planes of a run between its rounds, as files.
#pragma once
#include <filesystem>

#include "stereo/plane_map.h"

namespace dtr::pipeline {

/// One file per round and view in a folder of working files: an interrupted run goes on where it
/// stopped, and memory holds only the planes in use. Bytes of a file: int32 width, height (both 0:
/// no planes), then inverse depths and both slopes as float32, row-major, in the host's byte order.
/// Files appear whole or not at all. Load throws Error naming the file when it is not what Save
/// writes; so do Has and Drop where the folder cannot be read or a file not removed.
class PlaneFiles final : public stereo::PlaneMapStore {
 public:
  /// Creates the folder.
  explicit PlaneFiles(const std::filesystem::path& folder);
  bool Has(int round, int view) const override;
  std::shared_ptr<const stereo::PlaneMap> Load(int round, int view) override;
  void Save(int round, int view, stereo::PlaneMap&& map) override;
  void Drop(int round) override;

 private:
  std::filesystem::path File(int round, int view) const;
  std::filesystem::path folder_;
};

}  // namespace dtr::pipeline
