#include "calib/reference_tracks/tracks.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/boards/opencv_pixels.h"
#include "dtr/base/parallel_for.h"

namespace dtr::calib {
namespace {

constexpr int kMaxReferenceFeatures = 4000;  // per photo: two photos then take a tenth of a second
// A tenth of OpenCV's: small photos have few features, and of many the strongest are kept.
constexpr float kMinResponse = 1e-4F;
constexpr float kRatio = 0.8f;            // Lowe 2004
constexpr double kEpipolarShare = 0.003;  // of the long side: lenses bend lines by about as much
constexpr double kConfidence = 0.999;
constexpr size_t kMinAgreeing = 20;  // a fundamental matrix has 7 unknowns

struct Features {
  std::vector<cv::Point2f> at;      // OpenCV's pixels of the photo as it was looked at
  cv::Mat bits;                     // a row each
  double scale_x = 1, scale_y = 1;  // of the photo over what was looked at
  double long_side = 0;             // of that
};

cv::Mat Grey(const ImageRgb8& image) {
  // A view of our pixels; OpenCV's constructor wants them mutable but cvtColor only reads.
  const cv::Mat rgb(image.height(), image.width(), CV_8UC3,
                    const_cast<std::uint8_t*>(image.data().data()));
  cv::Mat grey;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  return grey;
}

void Shrink(cv::Mat& grey, cv::Mat& mask) {
  const double factor =
      static_cast<double>(kReferenceTracksSidePx) / std::max(grey.cols, grey.rows);
  if (factor >= 1) return;
  const cv::Size size(std::max(1, static_cast<int>(std::lround(factor * grey.cols))),
                      std::max(1, static_cast<int>(std::lround(factor * grey.rows))));
  cv::resize(grey, grey, size, 0, 0, cv::INTER_AREA);
  if (!mask.empty()) cv::resize(mask, mask, size, 0, 0, cv::INTER_NEAREST);
}

Features FeaturesOf(const ReferenceTracksPhoto& photo) {
  cv::Mat grey = Grey(photo.image), mask;
  if (!photo.mask.empty()) {
    mask = cv::Mat(photo.mask.height(), photo.mask.width(), CV_8UC1,
                   const_cast<std::uint8_t*>(photo.mask.data().data()));
  }
  Shrink(grey, mask);
  std::vector<cv::KeyPoint> points;
  const auto akaze = cv::AKAZE::create(cv::AKAZE::DESCRIPTOR_MLDB, 0, 3, kMinResponse);
  akaze->detect(grey, points, mask);
  std::stable_sort(points.begin(), points.end(),
                   [](const auto& a, const auto& b) { return a.response > b.response; });
  if (points.size() > kMaxReferenceFeatures) points.resize(kMaxReferenceFeatures);
  Features features;
  akaze->compute(grey, points, features.bits);
  for (const cv::KeyPoint& point : points) features.at.push_back(point.pt);
  features.scale_x = static_cast<double>(photo.image.width()) / grey.cols;
  features.scale_y = static_cast<double>(photo.image.height()) / grey.rows;
  features.long_side = std::max(grey.cols, grey.rows);
  return features;
}

// For each row of `a` its nearest of `b`, or -1 where the next is about as near.
std::vector<int> Nearest(const cv::Mat& a, const cv::Mat& b) {
  std::vector<std::vector<cv::DMatch>> two;
  cv::BFMatcher(cv::NORM_HAMMING).knnMatch(a, b, two, 2);
  std::vector<int> nearest(static_cast<size_t>(a.rows), -1);
  for (const auto& match : two) {
    if (match.size() == 2 && match[0].distance < kRatio * match[1].distance) {
      nearest[static_cast<size_t>(match[0].queryIdx)] = match[0].trainIdx;
    }
  }
  return nearest;
}

using Pairs = std::vector<std::pair<int, int>>;  // features of two photos

// What belongs together in two photos.
Pairs Agreeing(const Features& a, const Features& b) {
  if (a.at.size() < kMinAgreeing || b.at.size() < kMinAgreeing) return {};
  const std::vector<int> forth = Nearest(a.bits, b.bits), back = Nearest(b.bits, a.bits);
  Pairs pairs;
  std::vector<cv::Point2f> at_a, at_b;
  for (int i = 0; i < static_cast<int>(forth.size()); ++i) {
    const int j = forth[static_cast<size_t>(i)];
    if (j < 0 || back[static_cast<size_t>(j)] != i) continue;
    pairs.emplace_back(i, j);
    at_a.push_back(a.at[static_cast<size_t>(i)]);
    at_b.push_back(b.at[static_cast<size_t>(j)]);
  }
  if (pairs.size() < kMinAgreeing) return {};
  // OpenCV draws with a generator that it seeds again every time.
  std::vector<std::uint8_t> agrees;
  const double most_px = kEpipolarShare * std::max(a.long_side, b.long_side);
  cv::findFundamentalMat(at_a, at_b, cv::FM_RANSAC, most_px, kConfidence, agrees);
  Pairs agreeing;
  for (size_t i = 0; i < agrees.size(); ++i) {
    if (agrees[i] != 0) agreeing.push_back(pairs[i]);
  }
  if (agreeing.size() < kMinAgreeing) agreeing.clear();
  return agreeing;
}

// Sets of features that are joined, each known by its least member.
class Joined {
 public:
  explicit Joined(size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), size_t{0});
  }
  size_t RootOf(size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void Join(size_t a, size_t b) {
    a = RootOf(a);
    b = RootOf(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<size_t> parent_;
};

// Whether no photo has two observations; they lie by rising photo.
bool OncePerPhoto(const Track& track) {
  return std::adjacent_find(track.begin(), track.end(), [](const auto& a, const auto& b) {
           return a.photo == b.photo;
         }) == track.end();
}

std::vector<Track> Chained(const std::vector<Features>& features,
                           const std::vector<std::pair<int, int>>& photos,
                           const std::vector<Pairs>& agreeing) {
  std::vector<size_t> first{0};  // number of each photo's first feature among all
  for (const Features& one : features) first.push_back(first.back() + one.at.size());
  Joined joined(first.back());
  for (size_t k = 0; k < photos.size(); ++k) {
    for (const auto& [i, j] : agreeing[k]) {
      joined.Join(first[static_cast<size_t>(photos[k].first)] + static_cast<size_t>(i),
                  first[static_cast<size_t>(photos[k].second)] + static_cast<size_t>(j));
    }
  }
  std::map<size_t, Track> chains;
  for (size_t photo = 0; photo < features.size(); ++photo) {
    const Features& one = features[photo];
    for (size_t i = 0; i < one.at.size(); ++i) {
      chains[joined.RootOf(first[photo] + i)].push_back(
          {static_cast<int>(photo),
           {one.scale_x * (one.at[i].x + kOpenCvOffsetPx),
            one.scale_y * (one.at[i].y + kOpenCvOffsetPx)}});
    }
  }
  std::vector<Track> tracks;
  for (auto& [root, chain] : chains) {
    if (chain.size() >= kMinTrackLength && OncePerPhoto(chain)) tracks.push_back(std::move(chain));
  }
  return tracks;
}

}  // namespace

std::vector<Track> FindTracks(int photos, const std::function<ReferenceTracksPhoto(int)>& read,
                              Progress& progress) {
  std::vector<Features> features;
  progress.Stage("reference tracks: features", photos);
  for (int i = 0; i < photos; ++i) {
    progress.ThrowIfInterrupted();
    features.push_back(FeaturesOf(read(i)));
    progress.Update(i + 1);
  }
  std::vector<std::pair<int, int>> pairs;
  for (int a = 0; a < photos; ++a) {
    for (int b = a + 1; b < photos; ++b) pairs.emplace_back(a, b);
  }
  std::vector<Pairs> agreeing(pairs.size());
  progress.Stage("reference tracks: matching", static_cast<int>(pairs.size()));
  std::atomic<int> done = 0;
  ParallelFor(0, static_cast<int>(pairs.size()), [&](int k) {
    progress.ThrowIfInterrupted();
    const auto& [a, b] = pairs[static_cast<size_t>(k)];
    agreeing[static_cast<size_t>(k)] =
        Agreeing(features[static_cast<size_t>(a)], features[static_cast<size_t>(b)]);
    progress.Update(++done);
  });
  return Chained(features, pairs, agreeing);
}

}  // namespace dtr::calib
