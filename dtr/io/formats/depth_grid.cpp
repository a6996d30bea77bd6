#include "dtr/io/formats/depth_grid.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace dtr::io {
namespace {

// Inverse depths of a map along one axis through a pixel.
class Line {
 public:
  Line(const DepthImage& depth, int x, int y, int step_x, int step_y)
      : depth_(depth), x_(x), y_(y), step_x_(step_x), step_y_(step_y) {}

  // Change of inverse depth from pixel `at` to the next, counted from the middle; empty at holes,
  // the border and depth edges.
  std::optional<double> SlopeFrom(int at) const {
    const auto slope = Difference(at);
    if (!slope) return std::nullopt;
    constexpr double kSmallStep = 0.02;  // of the inverse depth: no edge worth the name
    if (std::abs(*slope) <= kSmallStep * *Inverse(at)) return slope;
    // A surface that is seen at a grazing angle has large steps too, but they continue.
    for (const auto& beside : {Difference(at - 1), Difference(at + 1)}) {
      if (beside && std::abs(*beside - *slope) <= std::abs(*slope) / 2) return slope;
    }
    return std::nullopt;
  }

 private:
  std::optional<double> Inverse(int at) const {
    const int x = x_ + at * step_x_, y = y_ + at * step_y_;
    if (!depth_.Contains(x, y) || DepthImage::IsHole(depth_(x, y))) return std::nullopt;
    return 1.0 / depth_(x, y);
  }
  std::optional<double> Difference(int at) const {
    const auto here = Inverse(at), next = Inverse(at + 1);
    if (!here || !next) return std::nullopt;
    return *next - *here;
  }

  const DepthImage& depth_;
  int x_, y_, step_x_, step_y_;
};

// The change of inverse depth over `offset` (within half a pixel) from the middle of the line: by
// the neighbour on that side, else by the one on the other.
double ChangeOver(double offset, const Line& line) {
  const auto before = line.SlopeFrom(-1), after = line.SlopeFrom(0);
  const auto& nearer = offset < 0 ? before : after;
  const auto& other = offset < 0 ? after : before;
  return offset * (nearer ? *nearer : other.value_or(0));
}

float DepthAt(const DepthImage& depth, const Eigen::Vector2d& pixel) {
  const int x = std::clamp(static_cast<int>(std::floor(pixel.x())), 0, depth.width() - 1);
  const int y = std::clamp(static_cast<int>(std::floor(pixel.y())), 0, depth.height() - 1);
  if (DepthImage::IsHole(depth(x, y))) return 0;
  const double nearest = 1.0 / depth(x, y);
  const double inverse = nearest + ChangeOver(pixel.x() - (x + 0.5), Line(depth, x, y, 1, 0)) +
                         ChangeOver(pixel.y() - (y + 0.5), Line(depth, x, y, 0, 1));
  const auto z = static_cast<float>(1 / inverse);
  return inverse > 0 && !DepthImage::IsHole(z) ? z : depth(x, y);
}

}  // namespace

std::optional<int> DepthScaleFor(int map_width, int map_height, int width_px, int height_px) {
  const double ratio_x = static_cast<double>(width_px) / map_width;
  const double ratio_y = static_cast<double>(height_px) / map_height;
  const bool same_shape = std::abs(map_height - height_px / ratio_x) < 1 ||
                          std::abs(map_width - width_px / ratio_y) < 1;
  if (!same_shape) return std::nullopt;
  for (int s = std::max(1, static_cast<int>(std::min(ratio_x, ratio_y))); s > 1; --s) {
    if (width_px % s == 0 && height_px % s == 0) return s;
  }
  return 1;
}

DepthImage Resampled(const DepthImage& depth_z, int width_px, int height_px,
                     const SourceOfPixel& source_of) {
  if (depth_z.kind() != DepthKind::kPlaneZ) {
    throw std::invalid_argument("Resampled: expected plane z, which is linear over planes");
  }
  DepthImage out(width_px, height_px);
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      const auto source = source_of({x + 0.5, y + 0.5});
      if (source) out(x, y) = DepthAt(depth_z, *source);
    }
  }
  return out;
}

}  // namespace dtr::io
