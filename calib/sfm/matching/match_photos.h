// calib/sfm/matching/match_photos.h -- photos in, pairs with matches and relative poses out.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "calib/sfm/view_graph.h"
#include "dtr/base/part.h"
#include "dtr/base/progress.h"

namespace dtr::sfm {

/// A photo with its features, the largest scale first; without descriptors where MatchOptions loads
/// them.
struct MatchPhoto {
  std::string name;
  int width_px = 0, height_px = 0;
  int camera = 0;  ///< index into the cameras
  Features features;
};

/// A part of the work, for one of several processes that share a journal.
struct MatchPart {
  enum class Stage {
    kPairs,         ///< which pairs are matched; the first, by one process
    kMatching,      ///< the largest features of two photos
    kVerification,  ///< relative poses, then all features; when all pairs went through kMatching
  };
  Stage stage = Stage::kPairs;
  Part part;  ///< of the pairs
};

struct MatchOptions {
  std::uint64_t seed = 0;
  /// Per camera whether its intrinsics hold as given, and no vote changes them; empty: of none.
  std::vector<bool> lens_is_known = {};
  /// Pairs (a < b, sorted) that may be matched; empty: all.
  std::optional<std::vector<std::pair<int, int>>> pairs = {};
  /// Of these, match each photo with those that resemble it and with the next in order only.
  bool preselect = false;
  /// Loads the descriptors of a photo's `largest` first features, or of all where it has fewer; as
  /// often as `descriptor_gb` gigabytes of them in memory (0: no bound) need. Threads call it at
  /// the same time. Empty: the photos have their own.
  std::function<std::vector<Descriptor>(int photo, size_t largest)> load_descriptors = {};
  double descriptor_gb = 0;
  /// Keeps what was matched, for an interrupted run of the same `journal_inputs` (all that the
  /// result depends on) to go on with. Empty: nothing is kept.
  std::filesystem::path journal = {};
  std::string journal_inputs = {};
  Progress* progress = nullptr;
};

struct MatchResult {
  ViewGraph graph;
  std::vector<std::string> notes;  ///< what a user should know: focal lengths voted, changed
};

/// Matches photos and finds the geometry of their pairs:
/// 1. the largest features of two photos by exact search, ratio test, both ways;
/// 2. where intrinsics are not known, a vote of the pairs on focal length and first radial
///    distortion (lens_vote.h), written into the graph's cameras;
/// 3. an essential matrix (a fundamental matrix where the focal length stays unknown), then all
///    features along its epipolar lines, and a second robust fit to these.
/// Distances grow with the photos' long side. `cameras`: priors; `focal_is_known`: of each camera,
/// EXIF told its focal length. Features of lenses that see more than 85 degrees off their axis are
/// left out there.
/// Deterministic: the same bytes for any number of threads. Photos without features get no pairs.
/// Throws std::invalid_argument when numbers of things that belong together differ or an index is
/// out of range, Interrupted when `progress` says so, Error where the journal cannot be written or
/// does not hold what a part needs. With `part` only this is done, into the journal, which a call
/// without one then goes on with; the result is not whole.
MatchResult MatchPhotos(std::span<const MatchPhoto> photos,
                        std::span<const calib::LensCamera> cameras,
                        const std::vector<bool>& focal_is_known, const MatchOptions& options,
                        const std::optional<MatchPart>& part = {});

}  // namespace dtr::sfm
