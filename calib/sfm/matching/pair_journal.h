// calib/sfm/matching/pair_journal.h -- pairs that were matched, on the disk: an interrupted run
// goes on after the last of them.
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

/// A file of records: the pairs that were chosen, then, block by block and in their order, matches
/// of their largest features, then their geometries.
class PairJournal {
 public:
  struct Content {
    std::optional<std::vector<std::pair<int, int>>> pairs;
    std::vector<CoarsePair> coarse;                       ///< of the first pairs
    std::vector<std::optional<PairGeometry>> geometries;  ///< of the first pairs
  };

  /// Nothing is kept.
  PairJournal() = default;
  /// `inputs` names all that the results depend on; `features`: their number for each photo. Takes
  /// over what `file` holds of the same inputs, as far as it is whole; anything else in it is
  /// dropped. Throws Error where it cannot be written.
  PairJournal(std::filesystem::path file, const std::string& inputs,
              std::span<const size_t> features);

  /// What an earlier run left, once.
  Content TakeContent() { return std::exchange(content_, {}); }

  /// These add a block; it is on the disk when they return. They throw Error where it cannot be.
  void AddPairs(std::span<const std::pair<int, int>> pairs);
  void AddCoarse(std::span<const CoarsePair> block);
  void AddGeometries(std::span<const std::optional<PairGeometry>> block);

 private:
  bool ReadHeader(std::istream& in, const std::string& inputs);
  bool ReadRecord(std::istream& in, std::uint64_t left, std::span<const size_t> features);

  std::filesystem::path file_;  // empty: nothing is kept
  Content content_;
};

}  // namespace dtr::sfm::matching
