#include "dtr/render/hole_cells.h"

#include <algorithm>
#include <cmath>

#include "dtr/base/parallel_for.h"
#include "dtr/render/colour.h"
#include "dtr/render/geometry.h"

namespace dtr {
namespace {

constexpr int kCellPx = 8, kMaxCells = 1 << 15;
constexpr float kOneViewCost = 20;
constexpr size_t kViewsCompared = 4;
constexpr double kAngleFloor = 0.02;  // radians: nearer views are all alike

}  // namespace

HoleCells::HoleCells(const Grid<float>& seen, const GuessedColours& guesses, int threads)
    : seen_(seen), guesses_(guesses), cell_px_(kCellPx), pictures_(guesses.views().size()) {
  while (Cells(seen.width()) * Cells(seen.height()) > kMaxCells) ++cell_px_;
  Summarise();
  ParallelFor(0, static_cast<int>(pictures_.size()), threads, [&](int i) {
    const auto k = static_cast<size_t>(i);
    pictures_[k] = Shrunk(guesses_.views()[k]);
  });
}

template <typename Body>
void HoleCells::ForEachPixel(int width_px, int height_px, int x, int y, const Body& body) const {
  for (int j = y * cell_px_; j < std::min((y + 1) * cell_px_, height_px); ++j) {
    for (int i = x * cell_px_; i < std::min((x + 1) * cell_px_, width_px); ++i) body(i, j);
  }
}

void HoleCells::Summarise() {
  known_ = Grid<double>(Cells(seen_.width()), Cells(seen_.height()));
  seen_share_ = Grid<float>(known_.width(), known_.height());
  for (int y = 0; y < rows(); ++y) {
    for (int x = 0; x < columns(); ++x) {
      double sum = 0;
      int count = 0, all = 0;
      ForEachPixel(seen_.width(), seen_.height(), x, y, [&](int i, int j) {
        ++all;
        if (!(seen_(i, j) > 0)) return;
        sum += 1 / static_cast<double>(seen_(i, j));
        ++count;
      });
      known_(x, y) = count > 0 ? sum / count : 0;
      seen_share_(x, y) = static_cast<float>(count) / static_cast<float>(all);
    }
  }
}

Eigen::Vector2d HoleCells::Centre(int x, int y) const {
  return {std::min((x + 0.5) * cell_px_, static_cast<double>(seen_.width())),
          std::min((y + 0.5) * cell_px_, static_cast<double>(seen_.height()))};
}

/// The photo, in the picture's exposure, averaged over cells: R, G, B in sRGB levels and 1, or all
/// 0 where it is masked.
Grid<float> HoleCells::Shrunk(const GuessedColours::Placed& placed) const {
  const View& view = *placed.view;
  Grid<float> small(Cells(view.image.width()), Cells(view.image.height()), 4);
  for (int y = 0; y < small.height(); ++y) {
    for (int x = 0; x < small.width(); ++x) {
      float sum[3] = {};
      int count = 0;
      ForEachPixel(view.image.width(), view.image.height(), x, y, [&](int i, int j) {
        if (!view.mask.empty() && view.mask(i, j) == 0) return;
        for (int c = 0; c < 3; ++c) sum[c] += static_cast<float>(view.image(i, j, c));
        ++count;
      });
      if (count == 0) continue;
      for (int c = 0; c < 3; ++c) {
        // The exposure is that of the photo times its gain.
        const double level =
            std::min(1.0, view.gain[c] * LinearFromSrgb(static_cast<double>(sum[c]) / count / 255));
        small(x, y, c) =
            static_cast<float>(255 * SrgbFromLinear(Exposed(level, placed.exposure[c])));
      }
      small(x, y, 3) = 1;
    }
  }
  return small;
}

float HoleCells::CostAt(const Eigen::Vector2d& pixel_of_novel, double inverse_depth) const {
  const Eigen::Vector3d ray = guesses_.novel().RayFromPixel(pixel_of_novel);
  std::vector<Answer> answers;
  answers.reserve(guesses_.views().size());
  double asked = 0, through = 0;
  for (size_t i = 0; i < guesses_.views().size(); ++i) {
    const auto& view = guesses_.views()[i];
    const Eigen::Vector3d p = view.pixel_from_novel_pixel * pixel_of_novel.homogeneous() +
                              inverse_depth * view.pixel_per_inverse_depth;
    if (!(p.z() > 0)) continue;
    const Eigen::Vector2d pixel = p.head<2>() / p.z();
    if (!view.view->camera.Contains(pixel)) continue;
    const Eigen::Vector3d c = inverse_depth * view.center_in_novel;
    const double angle = QuickAngle(c.cross(ray).norm(), ray.squaredNorm() - c.dot(ray));
    asked += 1 / (angle + kAngleFloor);
    const float z = view.view->depth(static_cast<int>(pixel.x()) / view.view->depth_scale,
                                     static_cast<int>(pixel.y()) / view.view->depth_scale);
    if (!DepthImage::IsHole(z)) {
      const double nearer = 1 / static_cast<double>(z) - inverse_depth / p.z();
      if (nearer < -2 * view.delta_inverse_depth) through += 1 / (angle + kAngleFloor);
      if (std::abs(nearer) > 2 * view.delta_inverse_depth) continue;
    }
    Answer answer{angle, {}};
    if (ColourOf(pictures_[i], pixel, answer.rgb)) answers.push_back(answer);
  }
  const auto seen_through = asked > 0 ? kMostCost * static_cast<float>(through / asked) : 0.0F;
  return Disagreement(answers) + seen_through;
}

/// Bilinear between the cells around. False where one of them is masked.
bool HoleCells::ColourOf(const Grid<float>& picture, const Eigen::Vector2d& pixel,
                         std::array<float, 3>& rgb) const {
  const double u = std::clamp(pixel.x() / cell_px_ - 0.5, 0.0, picture.width() - 1.0);
  const double v = std::clamp(pixel.y() / cell_px_ - 0.5, 0.0, picture.height() - 1.0);
  const int x0 = static_cast<int>(u), y0 = static_cast<int>(v);
  const int x1 = std::min(x0 + 1, picture.width() - 1), y1 = std::min(y0 + 1, picture.height() - 1);
  const auto fx = static_cast<float>(u - x0), fy = static_cast<float>(v - y0);
  if (picture(x0, y0, 3) == 0 || picture(x1, y0, 3) == 0 || picture(x0, y1, 3) == 0 ||
      picture(x1, y1, 3) == 0) {
    return false;
  }
  for (int c = 0; c < 3; ++c) {
    rgb[static_cast<size_t>(c)] =
        (1 - fy) * ((1 - fx) * picture(x0, y0, c) + fx * picture(x1, y0, c)) +
        fy * ((1 - fx) * picture(x0, y1, c) + fx * picture(x1, y1, c));
  }
  return true;
}

/// Twice the weighted mean distance of the nearest views' colours from their weighted mean.
float HoleCells::Disagreement(std::vector<Answer>& answers) {
  if (answers.empty()) return kMostCost;
  if (answers.size() == 1) return kOneViewCost;
  std::stable_sort(answers.begin(), answers.end(),
                   [](const Answer& a, const Answer& b) { return a.angle < b.angle; });
  answers.resize(std::min(answers.size(), kViewsCompared));
  std::array<double, 3> mean{};
  double weights = 0;
  for (const Answer& answer : answers) {
    const double weight = 1 / (answer.angle + kAngleFloor);
    weights += weight;
    for (size_t c = 0; c < 3; ++c) mean[c] += weight * static_cast<double>(answer.rgb[c]);
  }
  double distance = 0;
  for (const Answer& answer : answers) {
    for (size_t c = 0; c < 3; ++c) {
      distance += std::abs(static_cast<double>(answer.rgb[c]) - mean[c] / weights) /
                  (answer.angle + kAngleFloor) / 3;
    }
  }
  return std::min(kMostCost, static_cast<float>(2 * distance / weights));
}

}  // namespace dtr
