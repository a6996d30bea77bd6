// calib/sfm/run/store.h -- features and matches on the disk.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "calib/sfm/view_graph.h"

namespace dtr::sfm {

/// Names in a workspace.
inline constexpr char kFeatureFile[] = "features.bin", kMatchFile[] = "matches.bin";

/// Features of photos by their numbers, in one file that grows. The functions throw Error where it
/// is damaged or cannot be written.
class FeatureFile {
 public:
  /// An empty file in the place of any other.
  static void Create(const std::filesystem::path& file);
  /// Adds features of photos, which are on the disk when it returns.
  static void Add(const std::filesystem::path& file, std::span<const size_t> photos,
                  std::span<const Features> features);
  /// Drops all but the first `photos` of a file; false where it does not hold as many.
  static bool CutAfter(const std::filesystem::path& file, size_t photos);

  /// Opens a file; of one that others may add to, its first `photos`.
  explicit FeatureFile(const std::filesystem::path& file, size_t photos = kAll);

  bool Has(size_t photo) const { return record_of_.contains(photo); }
  std::vector<Keypoint> KeypointsOf(size_t photo) const;
  /// The `first` descriptors, or all where there are fewer. Several threads may call it.
  std::vector<Descriptor> DescriptorsOf(size_t photo, size_t first) const;
  Features Of(size_t photo) const;

 private:
  struct Record {
    std::uint64_t offset = 0, count = 0;  // of the keypoints, which the descriptors follow
  };
  Record RecordOf(size_t photo) const;

  static constexpr size_t kAll = ~size_t{0};

  std::filesystem::path file_;
  std::map<size_t, Record> record_of_;
  std::uint64_t left_ = 0;  // bytes after the photos that were opened
};

/// Cameras and pairs of a graph whose image i is photo i of a FeatureFile; the file is replaced
/// whole.
void WriteMatches(const std::filesystem::path& file, const ViewGraph& graph);

/// The graph that was written, with the positions of the features and these names. Throws Error
/// where the files are damaged or do not belong together.
ViewGraph ReadMatches(const std::filesystem::path& file, const FeatureFile& features,
                      std::span<const std::string> names);

}  // namespace dtr::sfm
