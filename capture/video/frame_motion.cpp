#include "capture/video/frame_motion.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <vector>

#include "dtr/base/order_statistics.h"

namespace dtr::capture {
namespace {

constexpr int kMaxCorners = 300;
constexpr int kMinCorners = 20;           // fewer may all lie on one moving thing
constexpr double kCornerQuality = 0.01;   // of the best corner's smaller eigenvalue
constexpr double kCornerDistance = 0.02;  // of the long side, so that they spread
constexpr float kComesBack = 0.5F;        // px, there and back

cv::Mat MatOf(const Grid<std::uint8_t>& grey) {
  return cv::Mat(grey.height(), grey.width(), CV_8UC1,
                 const_cast<std::uint8_t*>(grey.data().data()))  // OpenCV only reads it
      .clone();
}

double Distance(const cv::Point2f& a, const cv::Point2f& b) {
  return std::hypot(a.x - b.x, a.y - b.y);
}

}  // namespace

struct FrameMotion::Corners {
  cv::Mat last;
  std::vector<cv::Point2f> start, now;
  size_t count = 0;
  double long_side = 1;
};

FrameMotion::FrameMotion(const Grid<std::uint8_t>& grey) : corners_(std::make_unique<Corners>()) {
  Corners& corners = *corners_;
  corners.last = MatOf(grey);
  corners.long_side = std::max(grey.width(), grey.height());
  cv::goodFeaturesToTrack(corners.last, corners.start, kMaxCorners, kCornerQuality,
                          kCornerDistance * corners.long_side);
  corners.now = corners.start;
  corners.count = corners.start.size();
}

FrameMotion::~FrameMotion() = default;
FrameMotion::FrameMotion(FrameMotion&&) noexcept = default;
FrameMotion& FrameMotion::operator=(FrameMotion&&) noexcept = default;

bool FrameMotion::has_texture() const { return corners_->count >= kMinCorners; }

FrameMotion::State FrameMotion::Follow(const Grid<std::uint8_t>& grey) {
  Corners& corners = *corners_;
  const cv::Mat next = MatOf(grey);
  if (!corners.now.empty()) {
    std::vector<cv::Point2f> there, back;
    std::vector<std::uint8_t> found, found_back;
    std::vector<float> unused;
    cv::calcOpticalFlowPyrLK(corners.last, next, corners.now, there, found, unused);
    cv::calcOpticalFlowPyrLK(next, corners.last, there, back, found_back, unused);
    const cv::Rect2f inside(0, 0, static_cast<float>(next.cols), static_cast<float>(next.rows));
    size_t kept = 0;
    for (size_t i = 0; i < there.size(); ++i) {
      const bool followed = found[i] && found_back[i] && inside.contains(there[i]) &&
                            Distance(back[i], corners.now[i]) < kComesBack;
      if (!followed) continue;
      corners.start[kept] = corners.start[i];
      corners.now[kept++] = there[i];
    }
    corners.start.resize(kept);
    corners.now.resize(kept);
  }
  corners.last = next;

  State state;
  if (corners.count == 0) return state;
  state.kept = static_cast<double>(corners.now.size()) / static_cast<double>(corners.count);
  std::vector<double> ways;
  for (size_t i = 0; i < corners.now.size(); ++i) {
    ways.push_back(Distance(corners.now[i], corners.start[i]) / corners.long_side);
  }
  if (ways.empty()) return state;
  state.moved = UpperMedian(ways);
  return state;
}

}  // namespace dtr::capture
