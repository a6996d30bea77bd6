#include "dtr/render/hole_cells.h"

#include <algorithm>
#include <cmath>

#include "dtr/base/parallel_for.h"
#include "dtr/render/colour.h"

namespace dtr {
namespace {

constexpr int kCellPx = 8, kMaxCells = 1 << 15;
/// The photo, in the image's exposure.
Grid<float> InExposure(const ShrunkPhoto& photo, const Eigen::Vector3d& exposure) {
  Grid<float> picture(photo.light.width(), photo.light.height(), 4);
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      if (photo.usable(x, y) == 0) continue;
      for (int c = 0; c < 3; ++c) {
        const double level = SrgbFromLinear(Exposed(photo.light(x, y, c), exposure[c]));
        picture(x, y, c) = static_cast<float>(255 * level);
      }
      picture(x, y, 3) = 1;
    }
  }
  return picture;
}

}  // namespace

HoleCells::HoleCells(const Grid<float>& seen, const GuessedColours& guesses, ShrunkPhotos& photos,
                     int threads)
    : seen_(seen), guesses_(guesses), cell_px_(kCellPx), pictures_(guesses.views().size()) {
  while (Cells(seen.width()) * Cells(seen.height()) > kMaxCells) ++cell_px_;
  Summarise(threads);
  std::vector<const View*> views;
  for (const auto& placed : guesses_.views()) views.push_back(placed.view);
  const auto shrunk = photos.Of(views, cell_px_, threads);
  ParallelFor(0, static_cast<int>(pictures_.size()), threads, [&](int i) {
    const auto k = static_cast<size_t>(i);
    pictures_[k] = InExposure(*shrunk[k], guesses_.views()[k].exposure);
  });
  for (size_t k = 0; k < pictures_.size(); ++k) {
    views_.push_back(AskedAbout(guesses_.views()[k], pictures_[k]));
  }
}

CostView HoleCells::AskedAbout(const GuessedColours::Placed& placed,
                               const Grid<float>& picture) const {
  const View& view = *placed.view;
  CostView asked{};
  Eigen::Map<Eigen::Vector3d>(asked.pixel_per_inverse_depth) = placed.pixel_per_inverse_depth;
  Eigen::Map<Eigen::Vector3d>(asked.centre) = placed.center_in_novel;
  asked.tolerance = 2 * placed.delta_inverse_depth;
  asked.width_px = view.camera.width_px(), asked.height_px = view.camera.height_px();
  asked.depth = view.depth.grid().data().data();
  asked.depth_columns = view.depth.grid().width(), asked.depth_scale = view.depth_scale;
  asked.cells = picture.data().data();
  asked.cell_columns = picture.width(), asked.cell_rows = picture.height();
  return asked;
}

template <typename Body>
void HoleCells::ForEachPixel(int width_px, int height_px, int x, int y, const Body& body) const {
  for (int j = y * cell_px_; j < std::min((y + 1) * cell_px_, height_px); ++j) {
    for (int i = x * cell_px_; i < std::min((x + 1) * cell_px_, width_px); ++i) body(i, j);
  }
}

void HoleCells::Summarise(int threads) {
  known_ = Grid<double>(Cells(seen_.width()), Cells(seen_.height()));
  seen_share_ = Grid<float>(known_.width(), known_.height());
  ParallelFor(0, rows(), threads, [&](int y) {
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
  });
}

Eigen::Vector2d HoleCells::Centre(int x, int y) const {
  return {std::min((x + 0.5) * cell_px_, static_cast<double>(seen_.width())),
          std::min((y + 0.5) * cell_px_, static_cast<double>(seen_.height()))};
}

void HoleCells::CostsAt(const Eigen::Vector2d& pixel, std::span<const double> inverse_depths,
                        float* costs) const {
  CostPlace place{};
  const Eigen::Vector3d ray = guesses_.novel().RayFromPixel(pixel);
  Eigen::Map<Eigen::Vector3d>(place.ray) = ray;
  place.ray_squared = ray.squaredNorm();
  place.cell_px = cell_px_;
  std::vector<CostView> views = views_;
  for (size_t k = 0; k < views.size(); ++k) {
    Eigen::Map<Eigen::Vector3d>(views[k].pixel_at_infinity) =
        guesses_.views()[k].pixel_from_novel_pixel * pixel.homogeneous();
  }
  HoleCosts(place, views, inverse_depths, costs);
}

float HoleCells::CostAt(const Eigen::Vector2d& pixel, double inverse_depth) const {
  float cost = 0;
  CostsAt(pixel, {&inverse_depth, 1}, &cost);
  return cost;
}

}  // namespace dtr
