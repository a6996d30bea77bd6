#include "calib/sfm/run/pairs.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/image_io.h"

namespace dtr::sfm {
namespace {

// Squared ratio test on distances (Lowe 2004 uses 0.8); descriptors are unit vectors, so that
// distance^2 = 2 - 2 dot.
constexpr float kRatioSquared = 0.8f * 0.8f;

struct Best {
  Eigen::Index index = -1;
  bool distinct = false;
};

Best BestOfRow(const Eigen::RowVectorXf& dots) {
  Best best;
  float first = -2, second = -2;
  for (Eigen::Index j = 0; j < dots.size(); ++j) {
    if (dots[j] > first) {
      second = first;
      first = dots[j];
      best.index = j;
    } else if (dots[j] > second) {
      second = dots[j];
    }
  }
  best.distinct = (2 - 2 * first) < kRatioSquared * (2 - 2 * second);
  return best;
}

// The indices of scores above 0, the largest first, ties to the lower index.
std::vector<size_t> ByScore(const std::vector<int>& scores) {
  std::vector<size_t> order(scores.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return scores[a] > scores[b]; });
  std::erase_if(order, [&](size_t i) { return scores[i] <= 0; });
  return order;
}

// The first of an order, by index.
std::vector<size_t> First(std::vector<size_t> order, size_t count) {
  order.resize(std::min(order.size(), count));
  std::sort(order.begin(), order.end());
  return order;
}

}  // namespace

SmallFeatures SmallFeaturesOf(const ImageRgb8& image) {
  // A view of our pixels; OpenCV's constructor wants them mutable but cvtColor only reads.
  const cv::Mat rgb(image.height(), image.width(), CV_8UC3,
                    const_cast<std::uint8_t*>(image.data().data()));
  cv::Mat grey, small;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  const double scale =
      std::min(1.0, static_cast<double>(kSmallSidePx) / std::max(grey.cols, grey.rows));
  const cv::Size size(std::max(1, static_cast<int>(std::lround(scale * grey.cols))),
                      std::max(1, static_cast<int>(std::lround(scale * grey.rows))));
  cv::resize(grey, small, size, 0, 0, cv::INTER_AREA);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  cv::SIFT::create(kSmallFeatures)->detectAndCompute(small, cv::noArray(), keypoints, descriptors);
  // SIFT may return a few more than asked; rows beyond are as strong as the last kept.
  const int rows = std::min(descriptors.rows, kSmallFeatures);
  SmallFeatures features(rows, 128);
  for (int i = 0; i < rows; ++i) {
    const float* row = descriptors.ptr<float>(i);
    float sum = 0;
    for (int k = 0; k < 128; ++k) sum += row[k];
    for (int k = 0; k < 128; ++k) features(i, k) = sum > 0 ? std::sqrt(row[k] / sum) : 0.0f;
  }
  return features;
}

int Resemblance(const SmallFeatures& a, const SmallFeatures& b) {
  if (a.rows() == 0 || b.rows() == 0) return 0;
  const Eigen::MatrixXf dots = b * a.transpose();  // column i: feature i of a against all of b
  std::vector<Best> best_for_b;
  for (Eigen::Index j = 0; j < b.rows(); ++j) best_for_b.push_back(BestOfRow(dots.row(j)));
  int shared = 0;
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    const Best best = BestOfRow(dots.col(i).transpose());
    if (!best.distinct) continue;
    const Best& back = best_for_b[static_cast<size_t>(best.index)];
    if (back.distinct && back.index == i) ++shared;
  }
  return shared;
}

std::vector<size_t> Partners(const std::vector<int>& scores) {
  std::vector<size_t> order = ByScore(scores);
  const auto sure = static_cast<size_t>(
      std::count_if(order.begin(), order.end(), [&](size_t i) { return scores[i] >= kSure; }));
  if (sure > kNeighbours) {
    // The ranks grow by one factor from the last of the nearest to the last sure one, by 1 at
    // least.
    constexpr int kFar = kNeighbours - kNearest;
    const double factor = std::pow(static_cast<double>(sure) / kNearest, 1.0 / kFar);
    size_t last = kNearest - 1;
    for (int k = 1; k <= kFar; ++k) {
      const auto rank = static_cast<size_t>(std::lround(kNearest * std::pow(factor, k))) - 1;
      last = std::clamp(rank, last + 1, sure - 1 - static_cast<size_t>(kFar - k));
      order[static_cast<size_t>(kNearest + k - 1)] = order[last];
    }
  }
  return First(std::move(order), kNeighbours);
}

std::vector<std::pair<size_t, size_t>> PreselectPairs(std::span<const std::filesystem::path> files,
                                                      int threads, double memory_gb,
                                                      Progress& progress) {
  const auto features = SmallFeaturesOfFiles(files, threads, memory_gb, progress);
  const size_t count = files.size();
  std::vector<std::vector<int>> scores(count, std::vector<int>(count, 0));
  progress.Stage("comparing small images", static_cast<int>(count));
  std::atomic<int> done = 0;
  ParallelFor(0, static_cast<int>(count), threads, [&](int i) {
    progress.ThrowIfInterrupted();
    const auto a = static_cast<size_t>(i);
    for (size_t b = a + 1; b < count; ++b) scores[a][b] = Resemblance(features[a], features[b]);
    progress.Update(++done);
  });
  for (size_t a = 0; a < count; ++a) {
    for (size_t b = a + 1; b < count; ++b) scores[b][a] = scores[a][b];
  }
  std::set<std::pair<size_t, size_t>> pairs;
  for (size_t a = 0; a < count; ++a) {
    if (a + 1 < count) pairs.emplace(a, a + 1);
    for (const size_t b : Partners(scores[a])) pairs.emplace(std::min(a, b), std::max(a, b));
  }
  return {pairs.begin(), pairs.end()};
}

std::vector<SmallFeatures> SmallFeaturesOfFiles(std::span<const std::filesystem::path> files,
                                                int threads, double memory_gb, Progress& progress) {
  std::vector<SmallFeatures> features(files.size());
  MemoryBudget memory(memory_gb);
  progress.Stage("small images", static_cast<int>(files.size()));
  std::atomic<int> done = 0;
  ParallelFor(0, static_cast<int>(files.size()), threads, [&](int i) {
    progress.ThrowIfInterrupted();
    const auto index = static_cast<size_t>(i);
    const io::ImageHeader header = io::ReadImageHeader(files[index], memory_gb);
    const auto share = memory.TakeForPhoto(header.width_px, header.height_px);
    features[index] = SmallFeaturesOf(io::ReadImage(files[index], {.memory_gb = memory_gb}));
    progress.Update(++done);
  });
  return features;
}

std::vector<size_t> MostResembling(const SmallFeatures& photo,
                                   std::span<const SmallFeatures> others) {
  std::vector<int> scores;
  for (const SmallFeatures& other : others) scores.push_back(Resemblance(photo, other));
  return First(ByScore(scores), kNeighbours);
}

}  // namespace dtr::sfm
