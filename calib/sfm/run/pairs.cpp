#include "calib/sfm/run/pairs.h"

#include <algorithm>
#include <atomic>

#include "calib/sfm/matching/pair_choice.h"
#include "calib/sfm/run/own_steps.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/image_io.h"

namespace dtr::sfm {
std::vector<Features> SmallFeaturesOf(std::span<const std::filesystem::path> files,
                                      double memory_gb, Progress& progress) {
  std::vector<Features> features(files.size());
  MemoryBudget memory(memory_gb);
  progress.Stage("small images", static_cast<int>(files.size()));
  std::atomic<int> done = 0;
  ParallelFor(0, static_cast<int>(files.size()), [&](int i) {
    progress.ThrowIfInterrupted();
    const auto index = static_cast<size_t>(i);
    const io::ImageHeader header = io::ReadImageHeader(files[index], memory_gb);
    const auto share = memory.TakeForPhoto(header.width_px, header.height_px);
    features[index] = FeaturesOf(files[index], {}, kSmallSidePx, kSmallFeatures);
    progress.Update(++done);
  });
  return features;
}

ImagePairs PreselectPairs(std::span<const std::filesystem::path> files,
                          const std::optional<ImagePairs>& allowed, double memory_gb,
                          Progress& progress) {
  std::vector<MatchPhoto> photos(files.size());
  std::vector<Features> features = SmallFeaturesOf(files, memory_gb, progress);
  for (size_t i = 0; i < photos.size(); ++i) photos[i].features = std::move(features[i]);
  MatchOptions options;
  options.preselect = true;
  if (allowed) options.pairs.emplace(allowed->begin(), allowed->end());
  const auto chosen = matching::ChoosePairs(photos, options, progress);
  return {chosen.begin(), chosen.end()};
}

std::vector<size_t> MostResembling(const Features& photo, std::span<const Features> others) {
  std::vector<size_t> scores, order;
  for (size_t i = 0; i < others.size(); ++i) {
    scores.push_back(matching::CoarseMatches(photo.descriptors, others[i].descriptors).size());
    if (scores.back() > 0) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return scores[a] > scores[b]; });
  order.resize(std::min(order.size(), matching::kPartners));
  std::sort(order.begin(), order.end());
  return order;
}

}  // namespace dtr::sfm
