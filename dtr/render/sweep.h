// dtr/render/sweep.h -- SPEC 7.3: depth for large holes, by what the views agree on.
#pragma once
#include "dtr/render/guessed_colours.h"
#include "dtr/types/grid.h"

namespace dtr {

/// Inverse depth (plane z of the novel camera) per cell of a picture.
struct SweptDepth {
  int cell_px = 1;             ///< cells are squares of so many pixels
  double step = 0;             ///< between the inverse depths that were tried
  Grid<double> inverse_depth;  ///< 0: what was known or guessed stays

  /// At a pixel: between the four cells around where they belong together, else its cell's.
  double At(int x, int y) const;
};

/// `seen`: plane z where the picture was seen, 0 at holes. `guessed`: the same with the guesses of
/// SPEC 7.2. Cells without any seen pixel get the inverse depth at which the nearest views show one
/// colour, where that is clearly better than the guess; the empty grid where there is nothing to
/// sweep. Bounded: at most 2^15 cells and 256 inverse depths. Does not depend on the number of
/// threads.
SweptDepth SweepLargeHoles(const Grid<float>& seen, const Grid<float>& guessed,
                           const GuessedColours& guesses, int threads);

}  // namespace dtr
