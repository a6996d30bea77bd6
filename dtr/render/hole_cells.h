// dtr/render/hole_cells.h -- SPEC 7.3: an image in cells, and what it costs to put one of them at
// a depth.
#pragma once
#include <span>
#include <vector>

#include "dtr/render/guessed_colours.h"
#include "dtr/render/hole_cost.h"
#include "dtr/render/shrunk_photos.h"
#include "dtr/types/grid.h"

namespace dtr {

/// Squares of pixels of an image with holes. Costs are in levels of sRGB.
class HoleCells {
 public:
  static constexpr float kMaxCost = kMaxHoleCost;

  /// `seen`: plane z where the image was seen, 0 at holes. What is passed must outlive the cells.
  /// Does not depend on the number of threads.
  HoleCells(const Grid<float>& seen, const GuessedColours& guesses, ShrunkPhotos& photos,
            int threads);

  int cell_px() const { return cell_px_; }
  int columns() const { return known_.width(); }
  int rows() const { return known_.height(); }
  /// Mean 1/z of a cell's seen pixels; 0: none was seen.
  double known(int x, int y) const { return known_(x, y); }
  /// Share of a cell's pixels that were seen.
  float seen_share(int x, int y) const { return seen_share_(x, y); }
  /// Pixel position of a cell's centre.
  Eigen::Vector2d Centre(int x, int y) const;

  /// How little the views agree that the surface at a pixel position has these inverse depths.
  void CostsAt(const Eigen::Vector2d& pixel, std::span<const double> inverse_depths,
               float* costs) const;
  float CostAt(const Eigen::Vector2d& pixel, double inverse_depth) const;

 private:
  int Cells(int pixels) const { return (pixels + cell_px_ - 1) / cell_px_; }
  template <typename Body>
  void ForEachPixel(int width_px, int height_px, int x, int y, const Body& body) const;
  void Summarise(int threads);
  CostView AskedAbout(const GuessedColours::Placed& placed, const Grid<float>& picture) const;

  const Grid<float>& seen_;
  const GuessedColours& guesses_;
  int cell_px_;
  Grid<double> known_;
  Grid<float> seen_share_;
  std::vector<Grid<float>> pictures_;  ///< of the views, as CostView has them
  std::vector<CostView> views_;        ///< but for where a position lies at infinity
};

}  // namespace dtr
