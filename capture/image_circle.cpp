#include "capture/image_circle.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "dtr/base/order_statistics.h"

namespace dtr::capture {
namespace {

using Eigen::Vector2d;

constexpr size_t kLeastPhotos = 3;                     // one dark corner may be anything
constexpr int kDirections = 72;                        // around the middle
constexpr int kLeastPerQuarter = 3;                    // of 18: all corners are cut
constexpr double kBlackLevel = 12, kBrightLevel = 40;  // levels of luma, the brightest photo's
constexpr double kStepPx = 0.25;
constexpr double kRim = 1.5;             // pixels of a thumbnail that hold both sides of the edge
constexpr double kRoundness = 0.03;      // of the radius
constexpr double kMostOffMiddle = 0.06;  // of the long side
constexpr double kLeastRadius = 0.4;     // of the short side

/// The brightest of all images at each pixel, in levels.
class Brightest {
 public:
  explicit Brightest(std::span<const Grid<std::uint16_t>* const> images)
      : levels_(images.front()->width(), images.front()->height()) {
    for (const Grid<std::uint16_t>* image : images) {
      for (size_t i = 0; i < levels_.data().size(); ++i) {
        levels_.data()[i] = std::max(levels_.data()[i], image->data()[i] / 256.0f);
      }
    }
  }
  bool Contains(const Vector2d& p) const {
    return p.x() >= 0 && p.y() >= 0 && p.x() < levels_.width() && p.y() < levels_.height();
  }
  double At(const Vector2d& p) const {
    return levels_(static_cast<int>(p.x()), static_cast<int>(p.y()));
  }
  Vector2d Middle() const { return {0.5 * levels_.width(), 0.5 * levels_.height()}; }
  int width() const { return levels_.width(); }
  int height() const { return levels_.height(); }

 private:
  Grid<float> levels_;
};

Vector2d DirectionOf(int k) {
  const double angle = 2 * std::numbers::pi * (k + 0.5) / kDirections;
  return {std::cos(angle), std::sin(angle)};
}

/// Where the image ends from the middle outwards.
double BorderAlong(const Brightest& image, const Vector2d& from, const Vector2d& direction) {
  double r = 0;
  while (image.Contains(from + (r + kStepPx) * direction)) r += kStepPx;
  return r;
}

/// From the border inwards, the first place that is not black; empty: the border is not.
std::optional<Vector2d> EdgeAlong(const Brightest& image, const Vector2d& direction) {
  const Vector2d middle = image.Middle();
  const double border = BorderAlong(image, middle, direction);
  double r = border;
  while (r > 0 && image.At(middle + r * direction) <= kBlackLevel) r -= kStepPx;
  if (r <= 0 || border - r < 1) return std::nullopt;
  return middle + r * direction;
}

/// Least squares of |p|^2 = 2 p.c + r^2 - |c|^2 (Kasa 1976).
ImageCircle CircleThrough(const std::vector<Vector2d>& points) {
  Eigen::MatrixX3d rows(static_cast<Eigen::Index>(points.size()), 3);
  Eigen::VectorXd squares(static_cast<Eigen::Index>(points.size()));
  for (size_t i = 0; i < points.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    rows.row(row) << 2 * points[i].x(), 2 * points[i].y(), 1;
    squares[row] = points[i].squaredNorm();
  }
  const Eigen::Vector3d solution = rows.colPivHouseholderQr().solve(squares);
  const Vector2d centre = solution.head<2>();
  return {centre, std::sqrt(std::max(0.0, solution[2] + centre.squaredNorm()))};
}

/// Bright just inside, black just outside, as far as the image goes, all the way around.
bool HasSharpRim(const Brightest& image, const ImageCircle& circle) {
  std::vector<double> inside;
  for (int k = 0; k < kDirections; ++k) {
    const Vector2d in = circle.centre + (circle.radius - 2 * kRim) * DirectionOf(k);
    const Vector2d out = circle.centre + (circle.radius + kRim) * DirectionOf(k);
    if (image.Contains(in)) inside.push_back(image.At(in));
    if (image.Contains(out) && image.At(out) > kBlackLevel) return false;
  }
  return !inside.empty() && UpperMedian(inside) >= kBrightLevel;
}

}  // namespace

std::optional<ImageCircle> ImageCircleOf(std::span<const Grid<std::uint16_t>* const> thumbnails) {
  if (thumbnails.size() < kLeastPhotos || thumbnails.front()->empty()) return std::nullopt;
  const Brightest image(thumbnails);
  std::vector<Vector2d> edges;
  std::array<int, 4> per_quarter{};
  for (int k = 0; k < kDirections; ++k) {
    const auto edge = EdgeAlong(image, DirectionOf(k));
    if (!edge) continue;
    edges.push_back(*edge);
    ++per_quarter[static_cast<size_t>(4 * k / kDirections)];
  }
  if (*std::min_element(per_quarter.begin(), per_quarter.end()) < kLeastPerQuarter) {
    return std::nullopt;
  }
  const ImageCircle circle = CircleThrough(edges);
  const double far = std::max(1.0, kRoundness * circle.radius);
  for (const Vector2d& edge : edges) {
    if (std::abs((edge - circle.centre).norm() - circle.radius) > far) return std::nullopt;
  }
  const int long_side = std::max(image.width(), image.height());
  if ((circle.centre - image.Middle()).norm() > kMostOffMiddle * long_side) return std::nullopt;
  if (circle.radius < kLeastRadius * std::min(image.width(), image.height())) return std::nullopt;
  if (!HasSharpRim(image, circle)) return std::nullopt;
  return circle;
}

std::string LineOfImageCircle(const std::vector<Photo>& photos) {
  std::map<std::pair<int, int>, std::vector<const Photo*>> by_size;
  for (const Photo& photo : photos) {
    if (!photo.screening || photo.face || photo.HasMask()) continue;
    const Grid<std::uint16_t>& thumbnail = photo.screening->thumbnail;
    if (!thumbnail.empty()) by_size[{thumbnail.width(), thumbnail.height()}].push_back(&photo);
  }
  for (const auto& [size, same] : by_size) {
    std::vector<const Grid<std::uint16_t>*> thumbnails;
    for (const Photo* photo : same) thumbnails.push_back(&photo->screening->thumbnail);
    const auto circle = ImageCircleOf(thumbnails);
    if (!circle) continue;
    return fmt::format(
        "{} photos, first {}, are black outside a circle of {:.0f} % of their width, as a fisheye "
        "makes them: if it was one, give `lens_model` RADIAL_FISHEYE or OPENCV_FISHEYE",
        same.size(), same.front()->name, 100 * 2 * circle->radius / size.first);
  }
  return "";
}

}  // namespace dtr::capture
