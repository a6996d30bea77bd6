#include "calib/sfm/matching/match_photos.h"

#include <fmt/format.h>

#include <atomic>
#include <limits>
#include <stdexcept>

#include "calib/sfm/matching/overlay.h"
#include "calib/sfm/matching/pair_choice.h"
#include "calib/sfm/matching/pair_geometry.h"
#include "calib/sfm/matching/pair_journal.h"
#include "calib/sfm/matching/photo_blocks.h"
#include "calib/sfm/matching/vote_cameras.h"
#include "dtr/base/error.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/random.h"

namespace dtr::sfm {
namespace {

using namespace matching;

constexpr size_t kLargest = 3000;  // features of a photo for the search anywhere
constexpr size_t kAll = std::numeric_limits<size_t>::max();
constexpr size_t kPairsPerBlock = 512;  // that an interrupted run does again at most

void Check(std::span<const MatchPhoto> photos, std::span<const calib::LensCamera> cameras,
           const std::vector<bool>& focal_is_known, bool load) {
  if (focal_is_known.size() != cameras.size()) {
    throw std::invalid_argument("MatchPhotos: focal_is_known is not of the cameras");
  }
  for (const calib::LensCamera& camera : cameras) camera.Check();
  for (const MatchPhoto& photo : photos) {
    if (photo.camera < 0 || static_cast<size_t>(photo.camera) >= cameras.size()) {
      throw std::invalid_argument("MatchPhotos: a photo's camera is not among the cameras");
    }
    if (!load && photo.features.keypoints.size() != photo.features.descriptors.size()) {
      throw std::invalid_argument("MatchPhotos: keypoints and descriptors differ in number");
    }
  }
}

// The pairs that `done` lacks, of those of the part.
template <typename T>
std::vector<int> Missing(const std::vector<std::optional<T>>& done, const Part& part) {
  std::vector<int> missing;
  for (size_t k = part.Begin(done.size()); k < part.End(done.size()); ++k) {
    if (!done[k]) missing.push_back(static_cast<int>(k));
  }
  return missing;
}

// Works out what those pairs of the part lack that have nothing in `results` yet, in blocks whose
// descriptors fit into memory. `find(a, b, number)` gives a pair's result from what `cache` has of
// its photos; `keep(numbers)` keeps those of a block.
template <typename T, typename Cache, typename Find, typename Keep>
void FindMissing(const char* stage, const std::vector<std::pair<int, int>>& pairs, const Part& part,
                 const std::vector<double>& bytes, const MatchOptions& options, Progress& progress,
                 Cache& cache, std::vector<std::optional<T>>& results, const Find& find,
                 const Keep& keep) {
  const std::vector<int> missing = Missing(results, part);
  const size_t all = part.End(pairs.size()) - part.Begin(pairs.size());
  progress.Stage(stage, static_cast<int>(all));
  std::atomic<int> done = static_cast<int>(all - missing.size());
  std::vector<std::pair<int, int>> left;
  for (const int k : missing) left.push_back(pairs[static_cast<size_t>(k)]);
  for (size_t begin = 0, end = begin; begin < left.size(); begin = end) {
    end = BlockEnd(left, begin, bytes, options.descriptor_gb * kBytesPerGigabyte, kPairsPerBlock);
    cache.Require(std::span(left).subspan(begin, end - begin));
    ParallelFor(static_cast<int>(begin), static_cast<int>(end), [&](int i) {
      progress.ThrowIfInterrupted();
      const auto [a, b] = left[static_cast<size_t>(i)];
      const auto k = static_cast<size_t>(missing[static_cast<size_t>(i)]);
      results[k] = find(a, b, k);
      progress.Update(++done);
    });
    keep(std::span(missing).subspan(begin, end - begin));
  }
}

// Matches of the largest features of those pairs of the part that have none yet.
void CoarseSearch(std::span<const MatchPhoto> photos, const std::vector<std::pair<int, int>>& pairs,
                  const Part& part, const MatchOptions& options, PairJournal& journal,
                  Progress& progress, std::vector<std::optional<CoarsePair>>& coarse) {
  PhotoCache<LoadedDescriptors> largest(
      photos.size(), [&](int i) { return DescriptorsOf(photos, i, kLargest, options); });
  FindMissing(
      "comparing features", pairs, part, DescriptorBytes(photos, kLargest), options, progress,
      largest, coarse,
      [&](int a, int b, size_t) {
        return CoarsePair{a, b, CoarseMatches(largest[a].all, largest[b].all)};
      },
      [&](std::span<const int> which) { journal.AddCoarse(which, coarse); });
}

// What became of the part's pairs along epipolar lines.
void Verify(std::span<const MatchPhoto> photos, const std::vector<std::pair<int, int>>& pairs,
            const std::vector<CoarsePair>& coarse, const Overlay& overlay, const ViewGraph& graph,
            const Part& part, const MatchOptions& options, PairJournal& journal, Progress& progress,
            std::vector<std::optional<TriedPair>>& tried) {
  PhotoCache<RayFeatures> features(photos.size(), [&](int i) {
    const MatchPhoto& photo = photos[static_cast<size_t>(i)];
    return RaysOf(WithoutOverlay(overlay, i, photo.features.keypoints),
                  DescriptorsOf(photos, i, kAll, options),
                  graph.cameras[static_cast<size_t>(photo.camera)]);
  });
  const auto knows = [&](int photo) -> bool {
    return graph.focal_is_known[static_cast<size_t>(photos[static_cast<size_t>(photo)].camera)];
  };
  FindMissing(
      "matching", pairs, part, DescriptorBytes(photos, kAll), options, progress, features, tried,
      [&](int a, int b, size_t k) {
        return TriedPair{GeometryOf(features[a], features[b], coarse[k], knows(a) && knows(b),
                                    HashOf(options.seed, 2, a, b))};
      },
      [&](std::span<const int> which) { journal.AddGeometries(which, tried); });
}

// All of them; throws Error where a part of the pairs is missing.
std::vector<CoarsePair> AllOf(std::vector<std::optional<CoarsePair>>&& coarse) {
  const auto missing = Missing(coarse, Part{});
  if (!missing.empty()) {
    throw Error(
        fmt::format("matches: expected {} pairs that were compared, found {}; run all "
                    "parts of the stage matching first",
                    coarse.size(), coarse.size() - missing.size()));
  }
  std::vector<CoarsePair> all;
  for (auto& pair : coarse) all.push_back(std::move(*pair));
  return all;
}

// A part's own name among those of its journal.
std::string NameOf(const std::optional<MatchPart>& part) {
  if (!part || part->stage == MatchPart::Stage::kPairs) return "";
  return fmt::format("{}_{}_of_{}",
                     part->stage == MatchPart::Stage::kMatching ? "matching" : "verification",
                     part->part.index, part->part.count);
}

// The pairs to be matched: chosen now, unless that was done before.
std::vector<std::pair<int, int>> PairsOf(PairJournal::Content& kept,
                                         std::span<const MatchPhoto> photos,
                                         const MatchOptions& options, bool may_choose,
                                         PairJournal& journal, Progress& progress) {
  if (!kept.pairs) {
    if (!may_choose) {
      throw Error(
          "matches: expected pairs of photos that were chosen, found none; run the stage pairs "
          "first");
    }
    kept.pairs = ChoosePairs(photos, options, progress);
    journal.AddPairs(*kept.pairs);
    kept.coarse.resize(kept.pairs->size());
    kept.geometries.resize(kept.pairs->size());
  }
  return std::move(*kept.pairs);
}

PairJournal JournalOf(std::span<const MatchPhoto> photos, const MatchOptions& options,
                      const std::optional<MatchPart>& part) {
  if (options.journal.empty()) return {};
  std::vector<size_t> counts;
  for (const MatchPhoto& photo : photos) counts.push_back(photo.features.keypoints.size());
  const bool is_matching = part && part->stage == MatchPart::Stage::kMatching;
  return {options.journal, options.journal_inputs, counts, NameOf(part), !is_matching};
}

}  // namespace

MatchResult MatchPhotos(std::span<const MatchPhoto> photos,
                        std::span<const calib::LensCamera> cameras,
                        const std::vector<bool>& focal_is_known, const MatchOptions& options,
                        const std::optional<MatchPart>& part) {
  Check(photos, cameras, focal_is_known, options.load_descriptors != nullptr);
  SilentProgress silent;
  Progress& progress = options.progress != nullptr ? *options.progress : silent;
  MatchResult result;
  ViewGraph& graph = result.graph;
  graph.cameras.assign(cameras.begin(), cameras.end());
  graph.focal_is_known = focal_is_known;
  for (const MatchPhoto& photo : photos) {
    GraphImage image{photo.name, photo.camera, {}};
    for (const Keypoint& k : photo.features.keypoints) image.pixels.emplace_back(k.x_px, k.y_px);
    graph.images.push_back(std::move(image));
  }
  using Stage = MatchPart::Stage;
  const auto does = [&](Stage stage) { return !part || part->stage == stage; };
  const Part share = part ? part->part : Part{};
  PairJournal journal = JournalOf(photos, options, part);
  PairJournal::Content kept = journal.TakeContent();
  const auto pairs = PairsOf(kept, photos, options, does(Stage::kPairs), journal, progress);
  if (does(Stage::kMatching)) {
    CoarseSearch(photos, pairs, share, options, journal, progress, kept.coarse);
  }
  if (!does(Stage::kVerification)) return result;
  std::vector<CoarsePair> coarse = AllOf(std::move(kept.coarse));
  const Overlay overlay = FindOverlay(photos, cameras, coarse);
  RemoveOverlay(overlay, coarse);
  if (!overlay.note.empty()) result.notes.push_back(overlay.note);
  for (size_t c = 0; c < options.lens_is_known.size(); ++c) {
    if (options.lens_is_known[c]) graph.focal_is_known[c] = true;
  }
  VoteOnCameras(photos, coarse, options, graph, result.notes);
  Verify(photos, pairs, coarse, overlay, graph, share, options, journal, progress, kept.geometries);
  if (part) return result;
  for (auto& pair : kept.geometries) {
    if (pair->geometry) graph.pairs.push_back(std::move(*pair->geometry));
  }
  return result;
}

}  // namespace dtr::sfm
