// calib/sfm/matching/pair_journal.h -- pairs that were matched, on the disk: an interrupted run
// goes on after the last of them, and several processes share the work.
#pragma once
#include <cstdint>
#include <filesystem>
#include <istream>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "calib/sfm/matching/pair_choice.h"
#include "calib/sfm/view_graph.h"

namespace dtr::sfm::matching {

/// What became of a pair along its epipolar lines.
struct TriedPair {
  std::optional<PairGeometry> geometry;  ///< empty: it has none
};

/// A file of records: the pairs that were chosen, then blocks of matches of their largest features
/// and of their geometries, each pair with its number. Work that is shared out to several
/// processes has a file for each beside it, FILE.PART, of which each is written by one process and
/// all are read.
class PairJournal {
 public:
  struct Content {
    std::optional<std::vector<std::pair<int, int>>> pairs;
    std::vector<std::optional<CoarsePair>> coarse;     ///< one per pair, empty where it is not done
    std::vector<std::optional<TriedPair>> geometries;  ///< the same
  };

  /// Nothing is kept.
  PairJournal() = default;
  /// `inputs` names all that the results depend on; `features`: their number for each photo. Takes
  /// over what `file` and those of its parts hold of the same inputs, as far as each is whole.
  /// `part`: the name of the part that is written; empty: `file` is. Anything else in what is
  /// written is dropped. Throws Error where it cannot be written.
  /// Without `reads_parts` other parts, which may be large, stay unread.
  PairJournal(const std::filesystem::path& file, const std::string& inputs,
              std::span<const size_t> features, const std::string& part = "",
              bool reads_parts = true);

  /// Removes the file and those of its parts. Throws Error.
  static void Remove(const std::filesystem::path& file);

  /// What earlier runs and other processes left, once.
  Content TakeContent() { return std::exchange(content_, {}); }

  /// These add a block; it is on the disk when they return. They throw Error where it cannot be.
  void AddPairs(std::span<const std::pair<int, int>> pairs);
  /// Of the pairs of these numbers.
  void AddCoarse(std::span<const int> which, std::span<const std::optional<CoarsePair>> coarse);
  void AddGeometries(std::span<const int> which,
                     std::span<const std::optional<TriedPair>> geometries);

 private:
  std::uint64_t Read(const std::filesystem::path& file, const std::string& inputs,
                     std::span<const size_t> features);
  bool ReadRecord(std::istream& in, std::uint64_t left, std::span<const size_t> features);

  std::filesystem::path file_;  // empty: nothing is kept
  Content content_;
};

}  // namespace dtr::sfm::matching
