// stereo/patchmatch/kernel.h -- the inner loops, several pixels of a row at a time.
//
// Everything here works on one level of the image pyramid. A pixel's surface is a plane in inverse
// depth, w(x + dx, y + dy) = w + a dx + b dy in pixels: planes of the scene are linear in 1/z.
// With ray r = K^-1 (x, y, 1) the point r / w lands in a source view at m (x, y, 1) + w k
// (homogeneous), m = K' R K^-1 and k = K' t, so a plane's homography needs no inverse.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "dtr/types/grid.h"
#include "stereo/plane_map.h"

namespace dtr::stereo::patchmatch {

constexpr int kMaxViews = 8;  ///< neighbours used at most; the first ones, which are the best
/// Windows are 7x7. Measured on plaza without any filter, share of all true pixels within 1 %: 79.9
/// %; 5x5 79.0 %; every second pixel of 9x9 77.7 %, of 11x11 76.6 %.
constexpr int kRadius = 3;
constexpr int kTapStep = 1;
constexpr int kTapsPerSide = 2 * kRadius / kTapStep + 1;
constexpr int kTaps = kTapsPerSide * kTapsPerSide;
/// Border around the grids of the reference: the longest reach of propagation, and a group's width.
constexpr int kBorder = 56;
/// Border around source textures; a window that reaches beyond it is not compared.
constexpr int kTextureBorder = 16;
/// Rows of a texture are told apart by a signed 16-bit number of its places.
constexpr int kWidestTexture = 32767 - 2 * kTextureBorder;
/// Worst cost (NCC = -1); also of a window that does not fit into a view.
constexpr float kWorstCost = 2.0f;
/// What a plane costs more, at most, for missing the expected depth where a window has no texture:
/// enough to outweigh its chance minima. Where the texture has this variance (grey levels squared)
/// half of it, and less the more the photos show: a constant of 0.3 pulled textured surfaces by a
/// pixel to a depth that was wrong by 10 % (prior_test, PhotosThatContradictAPriorWin).
constexpr float kUnexpectedCost = 0.5f, kWeakTexture = 3.0f;

/// A grid with `kBorder` extra pixels on every side, addressed from -kBorder on.
template <typename T>
class Bordered {
 public:
  Bordered() = default;
  Bordered(int width, int height, T value)
      : grid_(width + 2 * kBorder, height + 2 * kBorder, 1, value) {}
  int stride() const { return grid_.width(); }
  T* at(int x, int y) { return grid_.row(y + kBorder) + x + kBorder; }
  const T* at(int x, int y) const { return grid_.row(y + kBorder) + x + kBorder; }

 private:
  Grid<T> grid_;
};
using BorderedGrid = Bordered<float>;

/// A grey image as 8-bit blocks of 2x2: one 32-bit load fetches what bilinear sampling needs.
struct Texture {
  int width = 0, height = 0;
  int stride = 0;                    ///< width + 2 kTextureBorder
  std::vector<std::uint32_t> quads;  ///< p(i, j) | p(i+1, j) << 8 | p(i, j+1) << 16 | ...
  Mask usable;                       ///< empty: all of it
};

/// One neighbour at one level.
struct Source {
  const Texture* texture = nullptr;
  /// Projection to texture index coordinates (pixel centre i at i + kTextureBorder).
  float m[9] = {};
  float k[3] = {};
  /// The neighbour's own planes of the pass before, if there was one; the factor from their
  /// inverse depths to the level's; and the projection back, from texture index coordinates to
  /// pixels of the reference.
  const PlaneMap* surface = nullptr;
  float surface_scale = 1;
  float back_m[9] = {};
  float back_k[3] = {};
};

/// The reference at one level; pixels outside the image have usable = 0.
struct Reference {
  int width = 0, height = 0;
  BorderedGrid grey;           ///< 0..255
  Bordered<std::int32_t> rgb;  ///< r | g << 8 | b << 16, sRGB-coded
  BorderedGrid usable;         ///< 1 or 0
};

/// Planes, costs and view weights of all pixels. Outside the image the cost is infinite.
struct State {
  BorderedGrid w, a, b, cost;
  std::vector<BorderedGrid> weight;  ///< per source; they sum to 1
  /// Planes that the neighbours' maps suggest, tried where w > 0; may be none.
  struct Hypothesis {
    BorderedGrid w, a, b;
  };
  std::vector<Hypothesis> hypotheses;
};

/// Inverse depth that another instrument measured at the pixels: planes, and one over the standard
/// deviation, 0 where nothing is known.
struct Expected {
  BorderedGrid w, a, b, inverse_sigma;
};

/// One level: what is matched. Inverse depths are in units in which the range's near end is 1.
struct Level {
  Reference reference;
  std::vector<Source> sources;
  std::optional<Expected> expected;
  std::optional<BorderedGrid> open;  ///< 1: worked on, 0: left as it is; none: all are worked on
  float w_min = 0, w_max = 1;
  std::uint64_t seed = 0;
};

/// What one visit of a pixel tries.
struct Sweep {
  int colour = 0;       ///< of the checkerboard: pixels with (x + y) % 2 == colour
  int number = 0;       ///< names the random numbers
  int iteration = 0;    ///< of this level; the test for good views gets stricter
  int far_regions = 4;  ///< strips of far pixels whose best plane is tried, 0 or 4
  bool move = true;     ///< try the best plane up to step_px nearer or farther
  bool jump = true;     ///< try a random inverse depth from the whole range
  float step_px = 4;    ///< largest random change, pixels of disparity at the window's centre
};

/// Estimate of one pixel.
struct PixelEstimate {
  float w = 0;         ///< inverse depth at the minimum of the cost
  float sigma = 0;     ///< its standard deviation by the cost's curvature and the views' agreement
  float cost = 0;      ///< weighted mean of 1 - NCC
  float px = 0;        ///< pixels of disparity per unit of w in the views used
  float texture = 0;   ///< variance of the window's pixels like its centre, grey levels squared
  int agreeing = 0;    ///< views that see the same surface there
  int consistent = 0;  ///< views whose own planes lead back to the pixel (after passes)
};

/// Colour of the checkerboard whose pixels get a first guess. Sweeps begin with the other.
constexpr int kGuessedColour = 1;

/// First guess for every second pixel: tries `samples` inverse depths spread over the range, half
/// of them with a random slant, and keeps the one with the least mean cost in the two best views,
/// or in the best alone with a surcharge. Returns the number of samples that were compared, as
/// SweepRow does: a benchmark divides it by the time.
std::int64_t SearchRow(const Level& level, int samples, int y, State* state);

/// Works out the cost and the view weights of the plane each pixel of one colour has, its
/// neighbours' and some new ones (Galliani et al., ICCV 2015; Xu and Tao, CVPR 2019) and keeps the
/// best. Reads only pixels of the other colour, so rows may run in any order.
std::int64_t SweepRow(const Level& level, const Sweep& sweep, int y, State* state);

/// View weights to begin a pass with: equal shares of the views whose own planes lead back to
/// within 3 pixels of the pixel, of all where none does. The others can hardly get a say, and
/// SweepRow need not look at most of them.
void ExpectRow(const Level& level, int y, State* state);

/// Finds the minimum of the cost to a fraction of a pixel with its sigma and the views that agree.
/// `out` has a row's length, as has `wanted`: pixels where that is 0 may be left out. Null: all are
/// wanted.
void EstimateRow(const Level& level, const State& state, int y, const float* wanted,
                 PixelEstimate* out);

/// Whether other places on a pixel's ray match about as well as its plane: where a texture repeats
/// within 12 pixels of disparity, and at infinity, where images are copies or mirrors show far
/// things. Worked out for pixels 0, 2, 4, ... of the row: ambiguous[x / 2] is 1 or 0. `wanted` as
/// for EstimateRow; what is left out stays as it was.
void AmbiguousRow(const Level& level, const State& state, int y, const float* wanted,
                  std::uint8_t* ambiguous);

/// Photometric cost, 1 - NCC, of each pixel's plane in the first source, moved by each of `steps`
/// in inverse depth: costs[n * width + x]. Nothing but the kernel, for tests and benchmarks;
/// returns the number of samples.
std::int64_t ScoreRow(const Level& level, const State& state, int y, std::span<const float> steps,
                      float* costs);

/// Name of the instruction set in use, for reports.
const char* InstructionSet();

}  // namespace dtr::stereo::patchmatch
