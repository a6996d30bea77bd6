#include "calib/sfm/matching/match_photos.h"

#include <atomic>
#include <limits>
#include <stdexcept>

#include "calib/sfm/matching/pair_choice.h"
#include "calib/sfm/matching/pair_geometry.h"
#include "calib/sfm/matching/pair_journal.h"
#include "calib/sfm/matching/photo_blocks.h"
#include "calib/sfm/matching/vote_cameras.h"
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

// Matches of the largest features of all pairs, in order; what the journal has is not done again.
std::vector<CoarsePair> CoarseSearch(std::span<const MatchPhoto> photos,
                                     const std::vector<std::pair<int, int>>& pairs,
                                     std::vector<CoarsePair> coarse, const MatchOptions& options,
                                     PairJournal& journal, Progress& progress) {
  PhotoCache<LoadedDescriptors> largest(
      photos.size(), [&](int i) { return DescriptorsOf(photos, i, kLargest, options); },
      options.threads);
  const std::vector<double> bytes = DescriptorBytes(photos, kLargest);
  progress.Stage("comparing features", static_cast<int>(pairs.size()));
  std::atomic<int> done = static_cast<int>(coarse.size());
  for (size_t begin = coarse.size(), end = begin; begin < pairs.size(); begin = end) {
    end = BlockEnd(pairs, begin, bytes, options.descriptor_gb * kBytesPerGigabyte, kPairsPerBlock);
    largest.Require(std::span(pairs).subspan(begin, end - begin));
    coarse.resize(end);
    ParallelFor(static_cast<int>(begin), static_cast<int>(end), options.threads, [&](int k) {
      progress.ThrowIfInterrupted();
      const auto [a, b] = pairs[static_cast<size_t>(k)];
      coarse[static_cast<size_t>(k)] = {a, b, CoarseMatches(largest[a].all, largest[b].all)};
      progress.Update(++done);
    });
    journal.AddCoarse(std::span(coarse).subspan(begin, end - begin));
  }
  return coarse;
}

// Pairs along epipolar lines, in order; those without a geometry are left out.
std::vector<PairGeometry> Geometries(std::span<const MatchPhoto> photos,
                                     const std::vector<std::pair<int, int>>& pairs,
                                     const std::vector<CoarsePair>& coarse,
                                     std::vector<std::optional<PairGeometry>> found,
                                     const ViewGraph& graph, const MatchOptions& options,
                                     PairJournal& journal, Progress& progress) {
  PhotoCache<RayFeatures> features(
      photos.size(),
      [&](int i) {
        const MatchPhoto& photo = photos[static_cast<size_t>(i)];
        return RaysOf(photo.features.keypoints, DescriptorsOf(photos, i, kAll, options),
                      graph.cameras[static_cast<size_t>(photo.camera)]);
      },
      options.threads);
  const std::vector<double> bytes = DescriptorBytes(photos, kAll);
  progress.Stage("matching", static_cast<int>(pairs.size()));
  std::atomic<int> done = static_cast<int>(found.size());
  for (size_t begin = found.size(), end = begin; begin < pairs.size(); begin = end) {
    end = BlockEnd(pairs, begin, bytes, options.descriptor_gb * kBytesPerGigabyte, kPairsPerBlock);
    features.Require(std::span(pairs).subspan(begin, end - begin));
    found.resize(end);
    ParallelFor(static_cast<int>(begin), static_cast<int>(end), options.threads, [&](int k) {
      progress.ThrowIfInterrupted();
      const auto [a, b] = pairs[static_cast<size_t>(k)];
      const auto knows = [&](int photo) -> bool {
        return graph.focal_is_known[static_cast<size_t>(photos[static_cast<size_t>(photo)].camera)];
      };
      found[static_cast<size_t>(k)] =
          GeometryOf(features[a], features[b], coarse[static_cast<size_t>(k)], knows(a) && knows(b),
                     HashOf(options.seed, 2, a, b));
      progress.Update(++done);
    });
    journal.AddGeometries(std::span(found).subspan(begin, end - begin));
  }
  std::vector<PairGeometry> geometries;
  for (auto& pair : found) {
    if (pair) geometries.push_back(std::move(*pair));
  }
  return geometries;
}

PairJournal JournalOf(std::span<const MatchPhoto> photos, const MatchOptions& options) {
  if (options.journal.empty()) return {};
  std::vector<size_t> counts;
  for (const MatchPhoto& photo : photos) counts.push_back(photo.features.keypoints.size());
  return {options.journal, options.journal_inputs, counts};
}

}  // namespace

MatchResult MatchPhotos(std::span<const MatchPhoto> photos,
                        std::span<const calib::LensCamera> cameras,
                        const std::vector<bool>& focal_is_known, const MatchOptions& options) {
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
  PairJournal journal = JournalOf(photos, options);
  PairJournal::Content kept = journal.TakeContent();
  if (!kept.pairs) {
    kept.pairs = ChoosePairs(photos, options, progress);
    journal.AddPairs(*kept.pairs);
  }
  const auto& pairs = *kept.pairs;
  const auto coarse =
      CoarseSearch(photos, pairs, std::move(kept.coarse), options, journal, progress);
  for (size_t c = 0; c < options.lens_is_known.size(); ++c) {
    if (options.lens_is_known[c]) graph.focal_is_known[c] = true;
  }
  VoteOnCameras(photos, coarse, options, graph, result.notes);
  graph.pairs = Geometries(photos, pairs, coarse, std::move(kept.geometries), graph, options,
                           journal, progress);
  return result;
}

}  // namespace dtr::sfm
