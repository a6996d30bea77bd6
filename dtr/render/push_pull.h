// dtr/render/push_pull.h -- SPEC 7.1: what a hole takes from its surroundings, at every scale.
#pragma once
#include <array>
#include <functional>
#include <vector>

#include "dtr/types/grid.h"

namespace dtr {

/// Which cells of each coarser level the holes of an image draw on; the others are never made, so
/// that an image with few holes costs little more than looking for them. Level l has cells of 2^l
/// pixels; level 0, the image itself, is not stored.
class HolePyramid {
 public:
  /// `hole` is not 0 where a pixel is unknown.
  explicit HolePyramid(const Mask& hole);
  int width() const { return width_; }
  int height() const { return height_; }
  /// needed()[l - 1] is not 0 for the needed cells of level l. It ends with the first level without
  /// an unknown cell, or with a level of a single one.
  const std::vector<Mask>& needed() const { return needed_; }

 private:
  int width_, height_;
  std::vector<Mask> needed_;
};

/// Push-pull (Gortler et al., The Lumigraph, SIGGRAPH 1996, sec. 3.5) of four values per pixel.
/// Made once for an image; then At() answers for any hole. Does not depend on the number of
/// threads.
class PushPull {
 public:
  struct Cell {
    double weight = 0;  ///< how much of the cell is known, at most 1; 0: nothing, and no value
    std::array<double, 4> values{};
  };

  /// `finest(x, y)` is the Cell of a pixel: weight 1 where it is known, else 0.
  PushPull(const HolePyramid& holes, const std::function<Cell(int x, int y)>& finest);

  /// What a hole takes; weight 0 when the image has no known pixel.
  Cell At(int x, int y) const;

 private:
  std::vector<Grid<Cell>> levels_;  ///< level 1 first
};

}  // namespace dtr
