#include "dtr/render/texture.h"

#include <algorithm>
#include <cmath>

#include "dtr/render/colour.h"

namespace dtr {

std::optional<Eigen::Vector3d> ColourAt(const View& view, const Eigen::Vector2d& pixel) {
  const ImageRgb8& image = view.image;
  const std::array<double, 256>& linear = LinearFromSrgb8();
  const double x = std::clamp(pixel.x() - 0.5, 0.0, image.width() - 1.0);
  const double y = std::clamp(pixel.y() - 0.5, 0.0, image.height() - 1.0);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, image.width() - 1), y1 = std::min(y0 + 1, image.height() - 1);
  const double fx = x - x0, fy = y - y0;
  const struct {
    int x, y;
    double weight;
  } taps[4] = {{x0, y0, (1 - fx) * (1 - fy)},
               {x1, y0, fx * (1 - fy)},
               {x0, y1, (1 - fx) * fy},
               {x1, y1, fx * fy}};
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weight_sum = 0;
  for (const auto& tap : taps) {
    if (!(tap.weight > 0) || (!view.mask.empty() && view.mask(tap.x, tap.y) == 0)) continue;
    const std::uint8_t* rgb = &image(tap.x, tap.y);
    sum += tap.weight * Eigen::Vector3d(linear[rgb[0]], linear[rgb[1]], linear[rgb[2]]);
    weight_sum += tap.weight;
  }
  if (!(weight_sum > 0)) return std::nullopt;
  return Eigen::Vector3d(sum.cwiseProduct(view.gain) / weight_sum);
}

}  // namespace dtr
