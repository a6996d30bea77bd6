#include "calib/boards/shown_board.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "calib/boards/board.h"
#include "calib/boards/opencv_aruco.h"
#include "calib/boards/opencv_images.h"
#include "calib/boards/opencv_pixels.h"
#include "dtr/base/order_statistics.h"

namespace dtr::calib {
namespace {

constexpr double kIntoQuadrant = 0.3;    // of the way to the next corners, along both
constexpr double kContrastShare = 0.4;   // of the seed's: shading and blur
constexpr double kMinContrast = 15;      // grey levels
constexpr double kFarthestMove = 0.2;    // of the spacing, by refinement
constexpr double kMinLatticeSine = 0.5;  // sine, between the two directions of the lattice
constexpr double kLineShare = 0.5;       // of the longest line; shorter ones are not the board's
constexpr size_t kMaxCorners = 10000;
constexpr int kCandidates = 1000, kSeeds = 40, kNeighbours = 8;
constexpr int kSmallestBoard = 3;  // corners per side

// Mean of 3 x 3 pixels; empty outside of the image.
std::optional<double> LevelAt(const Grid<std::uint8_t>& grey, const Eigen::Vector2d& place) {
  const int x = static_cast<int>(std::floor(place.x()));
  const int y = static_cast<int>(std::floor(place.y()));
  if (!grey.Contains(x - 1, y - 1) || !grey.Contains(x + 1, y + 1)) return {};
  double sum = 0;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) sum += grey(x + dx, y + dy);
  }
  return sum / 9;
}

// A corner of the lattice and the ways to the next ones.
struct Node {
  Eigen::Vector2d pixel, across, along;
};

// How much darker both quadrants of one diagonal are than both of the other; 0 where it is no
// saddle, or where a quadrant lies outside of the image.
double SaddleContrast(const Grid<std::uint8_t>& grey, const Node& node) {
  const auto at = [&](double a, double b) {
    return LevelAt(grey, node.pixel + kIntoQuadrant * (a * node.across + b * node.along));
  };
  const auto a = at(1, 1), b = at(-1, -1), c = at(1, -1), d = at(-1, 1);
  if (!a || !b || !c || !d) return 0;
  const double first = std::min(*a, *b) - std::max(*c, *d);
  const double second = std::min(*c, *d) - std::max(*a, *b);
  return std::max({first, second, 0.0});
}

Eigen::Vector2d Refined(const Grid<std::uint8_t>& grey, const Eigen::Vector2d& place,
                        double spacing) {
  const int half = std::clamp(static_cast<int>(0.3 * spacing), 2, 7);
  if (place.x() < half + 2 || place.y() < half + 2 || place.x() > grey.width() - half - 2 ||
      place.y() > grey.height() - half - 2) {
    return place;
  }
  std::vector<cv::Point2f> one{{static_cast<float>(place.x() - kOpenCvOffsetPx),
                                static_cast<float>(place.y() - kOpenCvOffsetPx)}};
  cv::cornerSubPix(Borrowed(grey), one, {half, half}, {-1, -1},
                   cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 20, 0.01));
  const Eigen::Vector2d moved(one[0].x + kOpenCvOffsetPx, one[0].y + kOpenCvOffsetPx);
  return (moved - place).norm() < kFarthestMove * spacing ? moved : place;
}

double Sine(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return std::abs(a.x() * b.y() - a.y() * b.x()) / (a.norm() * b.norm());
}

// Grows a lattice from one corner to all that hang together with it.
std::map<std::pair<int, int>, Node> Grown(const Grid<std::uint8_t>& grey, const Node& seed) {
  const double least = std::max(kMinContrast, kContrastShare * SaddleContrast(grey, seed));
  std::map<std::pair<int, int>, Node> nodes{{{0, 0}, seed}};
  std::deque<std::pair<int, int>> open{{0, 0}};
  while (!open.empty() && nodes.size() < kMaxCorners) {
    const auto [column, row] = open.front();
    open.pop_front();
    const Node from = nodes.at({column, row});
    for (const auto& [dx, dy] :
         {std::pair(1, 0), std::pair(-1, 0), std::pair(0, 1), std::pair(0, -1)}) {
      const std::pair<int, int> place(column + dx, row + dy);
      if (nodes.contains(place)) continue;
      const Eigen::Vector2d way = dx * from.across + dy * from.along;
      Node next{Refined(grey, from.pixel + way, std::min(from.across.norm(), from.along.norm())),
                from.across, from.along};
      if (SaddleContrast(grey, next) < least) continue;
      // Spacing changes from corner to corner: by perspective and distortion.
      (dx != 0 ? next.across : next.along) = (next.pixel - from.pixel) * (dx + dy);
      nodes.emplace(place, next);
      open.push_back(place);
    }
  }
  return nodes;
}

// Lines of the lattice that hold at least half as many corners as the longest one.
int LinesOf(const std::map<int, int>& corners_by_line) {
  int most = 0;
  for (const auto& [line, corners] : corners_by_line) most = std::max(most, corners);
  return static_cast<int>(
      std::count_if(corners_by_line.begin(), corners_by_line.end(),
                    [&](const auto& line) { return line.second >= kLineShare * most; }));
}

GridSize SizeOf(const std::map<std::pair<int, int>, Node>& nodes) {
  std::map<int, int> by_column, by_row;
  for (const auto& [place, node] : nodes) {
    ++by_column[place.first];
    ++by_row[place.second];
  }
  return {LinesOf(by_column), LinesOf(by_row)};
}

std::vector<Eigen::Vector2d> Candidates(const Grid<std::uint8_t>& grey) {
  std::vector<cv::Point2f> found;
  cv::goodFeaturesToTrack(Borrowed(grey), found, kCandidates, 0.05, 5);
  std::vector<Eigen::Vector2d> candidates;
  for (const cv::Point2f& p : found) {
    candidates.emplace_back(p.x + kOpenCvOffsetPx, p.y + kOpenCvOffsetPx);
  }
  return candidates;
}

// The corner at `pixel` with its neighbours among the candidates: the two nearest directions in
// which its quadrants are those of a chessboard.
std::optional<Node> SeedAt(const Grid<std::uint8_t>& grey, const Eigen::Vector2d& pixel,
                           const std::vector<Eigen::Vector2d>& candidates) {
  std::vector<Eigen::Vector2d> ways;
  for (const Eigen::Vector2d& candidate : candidates) {
    if ((candidate - pixel).norm() > 4) ways.push_back(candidate - pixel);
  }
  const size_t count = std::min<size_t>(kNeighbours, ways.size());
  std::partial_sort(ways.begin(), ways.begin() + static_cast<long>(count), ways.end(),
                    [](const auto& a, const auto& b) { return a.norm() < b.norm(); });
  std::optional<Node> best;
  double most = kMinContrast;
  for (size_t i = 0; i < count; ++i) {
    for (size_t j = 0; j < i; ++j) {
      if (Sine(ways[i], ways[j]) < kMinLatticeSine) continue;
      const Node node{pixel, ways[i], ways[j]};
      const double contrast = SaddleContrast(grey, node);
      // Of ways that show as much the first ones, which are nearer.
      if (contrast <= 1.1 * most) continue;
      most = contrast;
      best = node;
    }
  }
  return best;
}

}  // namespace

std::optional<ShownChessboard> FindChessboard(const Grid<std::uint8_t>& grey) {
  ShownChessboard largest;
  const auto candidates = Candidates(grey);
  const size_t step = std::max<size_t>(1, candidates.size() / kSeeds);
  for (size_t i = 0; i < candidates.size(); i += step) {
    const auto seed = SeedAt(grey, Refined(grey, candidates[i], 12), candidates);
    if (!seed) continue;
    const auto nodes = Grown(grey, *seed);
    const GridSize size = SizeOf(nodes);
    if (size.columns * size.rows <= largest.size.columns * largest.size.rows) continue;
    largest = {size, {}};
    for (const auto& [place, node] : nodes) largest.corners.push_back(node.pixel);
  }
  if (std::min(largest.size.columns, largest.size.rows) < kSmallestBoard) return std::nullopt;
  return largest;
}

namespace {

constexpr int kMaxSquares = 30;        // per row of a ChArUco board
constexpr size_t kMinMarkers = 6;      // a homography takes 4
constexpr double kInlierShare = 0.25;  // of a marker's side
constexpr double kMinInliers = 0.8;    // of the markers

struct SeenMarkers {
  std::vector<int> ids;
  std::vector<cv::Point2f> middles;
  double side_px = 0;  // median
};

SeenMarkers Detected(const cv::Mat& image, const std::string& dictionary) {
  std::vector<std::vector<cv::Point2f>> outlines;
  SeenMarkers seen;
  try {
    cv::aruco::detectMarkers(image, MarkersOf(dictionary), outlines, seen.ids);
  } catch (const cv::Exception&) {
    return {};
  }
  std::vector<double> sides;
  for (const auto& outline : outlines) {
    seen.middles.push_back(0.25 * (outline[0] + outline[1] + outline[2] + outline[3]));
    sides.push_back(cv::norm(outline[0] - outline[1]));
  }
  if (!sides.empty()) seen.side_px = UpperMedian(sides);
  return seen;
}

// Square (column, row) of a marker on a board with so many squares per row.
cv::Point2f SquareOf(int id, int columns, bool first_white) {
  const int first_row = first_white ? (columns + 1) / 2 : columns / 2;  // markers lie in white ones
  const int pair = id / columns, in_pair = id % columns;
  const bool second = in_pair >= first_row;
  const int offset = (first_white ? 0 : 1) ^ (second ? 1 : 0);
  const int column = offset + 2 * (second ? in_pair - first_row : in_pair);
  return {static_cast<float>(column), static_cast<float>(2 * pair + (second ? 1 : 0))};
}

double InlierShare(const SeenMarkers& seen, int columns, bool first_white) {
  std::vector<cv::Point2f> squares;
  for (const int id : seen.ids) squares.push_back(SquareOf(id, columns, first_white));
  std::vector<std::uint8_t> agrees;
  const cv::Mat homography = cv::findHomography(squares, seen.middles, cv::RANSAC,
                                                kInlierShare * seen.side_px, agrees, 500, 0.99);
  if (homography.empty()) return 0;
  return static_cast<double>(std::count(agrees.begin(), agrees.end(), 1)) /
         static_cast<double>(agrees.size());
}

void FindLayout(const SeenMarkers& seen, ShownMarkers& shown) {
  if (seen.ids.size() < kMinMarkers) return;
  double most = kMinInliers;
  for (int columns = 2; columns <= kMaxSquares; ++columns) {
    for (const bool first_white : {false, true}) {
      const double share = InlierShare(seen, columns, first_white);
      if (share <= most) continue;
      most = share;
      shown.columns = columns;
      shown.first_square_white = first_white;
      shown.rows = static_cast<int>(SquareOf(shown.largest_id, columns, first_white).y) + 1;
    }
  }
}

std::string SmallestWith(const std::string& family, int largest_id) {
  for (const int size : {50, 100, 250, 1000}) {
    const std::string name = family + "_" + std::to_string(size);
    if (largest_id < size && DictionaryNumber(name) >= 0) return name;
  }
  return family;
}

}  // namespace

std::string FamilyOf(const std::string& dictionary) {
  const size_t at = dictionary.rfind('_');
  const std::string end = dictionary.substr(at + 1);
  const bool sized =
      at != std::string::npos && end.find_first_not_of("0123456789") == std::string::npos;
  return sized ? dictionary.substr(0, at) : dictionary;
}

std::optional<ShownMarkers> MarkersShown(const Grid<std::uint8_t>& grey, bool inverted,
                                         const std::string& dictionary) {
  const cv::Mat image = inverted ? Inverted(Borrowed(grey)) : Borrowed(grey);
  std::optional<ShownMarkers> best;
  // The largest dictionary of each size of marker begins with those of the smaller ones.
  for (const char* name :
       {"DICT_4X4_1000", "DICT_5X5_1000", "DICT_6X6_1000", "DICT_7X7_1000", "DICT_ARUCO_ORIGINAL",
        "DICT_APRILTAG_16h5", "DICT_APRILTAG_25h9", "DICT_APRILTAG_36h10", "DICT_APRILTAG_36h11"}) {
    if (!dictionary.empty() && FamilyOf(name) != FamilyOf(dictionary)) continue;
    const SeenMarkers seen = Detected(image, name);
    if (seen.ids.empty()) continue;
    const int largest = *std::max_element(seen.ids.begin(), seen.ids.end());
    ShownMarkers shown{SmallestWith(FamilyOf(name), largest), static_cast<int>(seen.ids.size()),
                       largest};
    FindLayout(seen, shown);
    // Dictionaries of few bits are found in any texture, but not in the order of a board.
    const auto rank = [](const ShownMarkers& m) { return std::pair(m.columns > 0, m.count); };
    if (!best || rank(shown) > rank(*best)) best = shown;
  }
  return best;
}

}  // namespace dtr::calib
