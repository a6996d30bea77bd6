// dtr/render/guess_kernel.h -- SPEC 7.2 for several pixels of a row at once, with the processor's
// vector instructions. Only dtr/render's own .cpp files and its tests include this. All results are
// the same bytes whatever the processor's vectors hold.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace dtr {

/// A view as it is asked about the pixels of a row.
struct GuessView {
  /// Homogeneous pixel of the view: at_0 + x per_x + w per_inverse_depth.
  double pixel_at_0[3], pixel_per_x[3], pixel_per_inverse_depth[3];
  double centre[3];  ///< in the novel frame
  double delta;      ///< a difference of 1/z
  int width_px, height_px;
  const float* depth;  ///< plane z, `depth_columns` in a row, a value for depth_scale^2 pixels
  int depth_columns, depth_scale;
  double fade_width_px;  ///< of SPEC 7.4 at the photo's rim
  double exposure[3];    ///< as Exposed takes it
};

/// The row's pixels on the novel camera: x to ray, z = 1.
struct GuessRow {
  double fx_px, cx_px, ray_y;
};

/// So many pixels are asked about together.
inline constexpr size_t kGuessesTogether = 8;
using GuessLanes = double[kGuessesTogether];

/// Of inverse depths from `nearest` to `farthest` the nearest that no view sees through, else
/// `farthest`. `sceptic`: the view that is asked first, since it saw through a guess last; decides
/// nothing but the time.
void FindGuesses(std::span<const GuessView> views, const GuessLanes& x, const GuessLanes& farthest,
                 const GuessLanes& nearest, size_t& sceptic, GuessLanes& inverse_depth);

/// What the views say of points, view by view.
struct GuessAnswers {
  struct OfView {
    GuessLanes answers;  ///< 1: the point is on the photo and nothing nearer hides it; else 0
    GuessLanes pixel_x, pixel_y;
    GuessLanes angle_rad, fade, share;
    GuessLanes rgb[3];  ///< linear light; filled in by whoever asks
  };
  std::vector<OfView> views;
};

/// Fills in who answers, and where on its photo.
void AskViews(std::span<const GuessView> views, const GuessLanes& x,
              const GuessLanes& inverse_depth, GuessAnswers& answers);

/// Fills in angles (SPEC 4.5) and fades.
void AnglesOfViews(std::span<const GuessView> views, const GuessRow& row, const GuessLanes& x,
                   const GuessLanes& inverse_depth, GuessAnswers& answers);

/// Fills in the shares of the weight `inverse-angle`, as BlendShares has them.
void ShareByInverseAngle(double pixel_angle_rad, int power, GuessAnswers& answers);

/// The views' colours in the image's exposure, blended; `answered`: 1 where some view answered,
/// else 0.
void MixAnswers(std::span<const GuessView> views, GuessAnswers& answers, GuessLanes (&rgb)[3],
                GuessLanes& answered);

}  // namespace dtr
