#include "calib/boards/detect.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/boards/corner_noise.h"
#include "calib/boards/opencv_aruco.h"
#include "calib/boards/opencv_images.h"
#include "calib/boards/opencv_pixels.h"

namespace dtr::calib {
namespace {

constexpr int kSmallestHalfWindowPx = 2;
constexpr size_t kMinCorners = 4;  // a homography needs as many
// Of the way to the next corner; more, and the window sees that corner's edges too.
constexpr double kWindowShare = 0.45;

using Found = std::vector<std::pair<int, cv::Point2f>>;  // ids rising, OpenCV's pixels

std::vector<cv::Point2f> ChessboardCorners(const cv::Mat& image, const Board& board,
                                           ChessboardDetector detector) {
  const cv::Size size(board.columns, board.rows);
  std::vector<cv::Point2f> corners;
  if (detector != ChessboardDetector::kSectors &&
      cv::findChessboardCorners(image, size, corners,
                                cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE)) {
    return corners;
  }
  if (detector != ChessboardDetector::kQuads &&
      cv::findChessboardCornersSB(image, size, corners,
                                  cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE)) {
    return corners;
  }
  return {};
}

Found FindChessboard(const cv::Mat& image, const Board& board, ChessboardDetector detector) {
  const std::vector<cv::Point2f> corners = ChessboardCorners(image, board, detector);
  Found found;
  for (size_t i = 0; i < corners.size(); ++i) found.emplace_back(static_cast<int>(i), corners[i]);
  return found;
}

Found FindCharuco(const cv::Mat& given, const Board& board) {
  const cv::Mat image = board.inverted ? Inverted(given) : given;
  const auto dictionary = MarkersOf(board.dictionary);
  const auto charuco = CharucoOf(board, dictionary);
  std::vector<std::vector<cv::Point2f>> markers;
  std::vector<int> marker_ids;
  cv::aruco::detectMarkers(image, dictionary, markers, marker_ids);
  if (marker_ids.empty()) return {};
  std::vector<cv::Point2f> corners;
  std::vector<int> ids;
  cv::aruco::interpolateCornersCharuco(markers, marker_ids, image, charuco, corners, ids);
  Found found;
  for (size_t i = 0; i < ids.size(); ++i) found.emplace_back(ids[i], corners[i]);
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  return found;
}

// Distance to the nearest neighbour on the board, of all corners: what a window must stay within.
double NearestNeighbour(const Found& found, const Board& board) {
  double nearest = 1e30;
  for (const auto& [id, corner] : found) {
    for (const auto& [other_id, other] : found) {
      const int dx = std::abs(id % board.columns - other_id % board.columns);
      const int dy = std::abs(id / board.columns - other_id / board.columns);
      if (dx + dy == 1) nearest = std::min(nearest, cv::norm(corner - other));
    }
  }
  return nearest;
}

int HalfWindow(const Found& found, const Board& board, int most_px) {
  // Markers begin half of what they leave of their square away from the corner.
  const double share =
      board.kind == Board::Kind::kCharuco ? (1 - board.marker_share) / 2 : kWindowShare;
  const double fitting = std::min(1e6, share * NearestNeighbour(found, board));
  return std::clamp(static_cast<int>(fitting), kSmallestHalfWindowPx,
                    std::max(most_px, kSmallestHalfWindowPx));
}

void Refine(const cv::Mat& image, int half_window_px, Found& found) {
  std::vector<cv::Point2f> corners;
  for (const auto& [id, corner] : found) corners.push_back(corner);
  cv::cornerSubPix(image, corners, cv::Size(half_window_px, half_window_px), cv::Size(-1, -1),
                   cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-4));
  for (size_t i = 0; i < corners.size(); ++i) found[i].second = corners[i];
}

// True when the corners span a plane: three on a line say nothing about the board's tilt.
bool SpanAPlane(const Found& found, const Board& board) {
  Eigen::MatrixXd places(2, static_cast<long>(found.size()));
  for (size_t i = 0; i < found.size(); ++i) {
    places.col(static_cast<long>(i)) = board.Corner(found[i].first).head<2>() / board.square;
  }
  places.colwise() -= Eigen::Vector2d(places.rowwise().mean());
  return Eigen::JacobiSVD<Eigen::MatrixXd>(places).singularValues()[1] > 0.5;
}

}  // namespace

Grid<std::uint8_t> GreyOf(const ImageRgb8& image) {
  Grid<std::uint8_t> grey(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      // Weights sum to 1000, so that grey photos keep their values.
      const int luma = 299 * image(x, y, 0) + 587 * image(x, y, 1) + 114 * image(x, y, 2);
      grey(x, y) = static_cast<std::uint8_t>((luma + 500) / 1000);
    }
  }
  return grey;
}

Detection DetectBoard(const Grid<std::uint8_t>& grey, const Board& board,
                      const DetectOptions& options) {
  const cv::Mat image = Borrowed(grey);
  const bool charuco = board.kind == Board::Kind::kCharuco;
  Detection detection;
  Found found;
  try {
    found = charuco ? FindCharuco(image, board) : FindChessboard(image, board, options.detector);
  } catch (const cv::Exception& error) {
    detection.reason = "OpenCV's detector gave up: " + error.err;
    return detection;
  }
  if (charuco && (found.size() < kMinCorners || !SpanAPlane(found, board))) {
    detection.reason = fmt::format("expected at least {} corners of the board, found {}",
                                   kMinCorners, found.size());
    if (found.size() >= kMinCorners) detection.reason += " on one line";
    return detection;
  }
  if (found.empty()) {
    detection.reason = fmt::format("expected the whole board, {} x {} inner corners, found none",
                                   board.columns, board.rows);
    return detection;
  }
  const int half_window_px = HalfWindow(found, board, options.half_window_px);
  Refine(image, half_window_px, found);
  for (const auto& [id, corner] : found) {
    detection.corners.push_back({id, {corner.x + kOpenCvOffsetPx, corner.y + kOpenCvOffsetPx}});
  }
  detection.noise_px = CornerNoise(grey, detection.corners, half_window_px);
  return detection;
}

}  // namespace dtr::calib
