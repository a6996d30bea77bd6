// dtr/render/large_holes.h -- SPEC 7.3: planes for large holes, by what the views agree on.
#pragma once
#include <array>
#include <vector>

#include "dtr/render/guessed_colours.h"
#include "dtr/render/hole_planes.h"
#include "dtr/render/shrunk_photos.h"
#include "dtr/types/grid.h"

namespace dtr {

/// Which of an image's planes the cells of its holes lie on.
struct HolePlanes {
  static constexpr int kGuess = -1;

  int cell_px = 1;  ///< cells are squares of so many pixels
  std::vector<ImagePlane> planes;
  Grid<int> chosen;  ///< index of a plane, or kGuess: what was known or guessed stays

  /// Inverse depths and their shares, at most 1 together; the rest is the guess's.
  struct Mix {
    int count = 0;
    std::array<double, 4> inverse_depth{}, share{};
  };
  /// At a pixel: what the four cells around chose, each as the bilinear weights say, so that
  /// nothing of the cells shows in the image.
  Mix At(int x, int y) const;
};

/// `seen`: plane z where the image was seen, 0 at holes. `guessed`: the same with the guesses of
/// SPEC 7.2. Empty where there is nothing to choose from. Bounded: at most 2^15 cells and 256
/// inverse depths. Does not depend on the number of threads, nor on what `photos` kept before.
HolePlanes ChooseHolePlanes(const Grid<float>& seen, const Grid<float>& guessed,
                            const GuessedColours& guesses, ShrunkPhotos& photos, int threads);

}  // namespace dtr
