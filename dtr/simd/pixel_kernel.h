// dtr/simd/pixel_kernel.h -- SPEC 4 to 6 for a row of pixels of the deferred method, several at
// once with the processor's vector instructions. Only dtr/simd's own .cpp files include this.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "dtr/render/options.h"

namespace dtr::simd {

/// Values are read by whole vectors: so many beyond the last one that is asked for may be, too.
inline constexpr size_t kReadBeyond = 64;

/// Squares of a view's samples where there is nothing to look up.
enum PixelCell : std::uint32_t {
  kCellOfSamples,  ///< there is one
  kCellOfHoles,    ///< none, and not all are masked
  kMaskedCell,     ///< all are masked
};
inline constexpr int kLog2PixelCell = 5;

/// A view as the kernel knows it. Everything is relative to the novel camera and was formed in
/// double precision. Grid positions: centre of the first sample at 0.5.
struct PixelView {
  /// Novel ray r (z = 1) at inverse depth w to the grid of samples, homogeneous: x is the dot
  /// product of grid_x[0..2] and r, plus grid_x[3] w; y and z likewise.
  float grid_x[4], grid_y[4], grid_z[4];
  float centre[3], centre_squared;  ///< the view's, in the novel frame; its squared length
  int columns, rows;                ///< of the samples
  /// The samples with the outermost ones once more around them, row by row, `stride` in a row; one
  /// of the two. kReadBeyond more codes follow. 1/z of a sample v > 0 is depth_offset +
  /// depth_factor v; 0: none.
  const std::uint16_t* codes;
  const float* values;
  int stride;
  /// A bit for the block right of and below each of these samples: IsWholeBlock or IsMaskedBlock.
  const std::uint32_t* whole_blocks;
  /// What a square of 2^kLog2PixelCell such blocks per axis holds, a PixelCell each, `cell_stride`
  /// in a row; null where all hold samples.
  const std::uint32_t* cells;
  int cell_stride;
  float depth_offset, depth_factor;
  float pixel, delta;  ///< differences of 1/z: SPEC 0.3, 4.2
  float level_range;   ///< blocks whose samples differ by no more are whole; below 0: ask the bits
  float cut_factor;    ///< SPEC 1.4
  float fade_gain, fade_offset;  ///< SPEC 4.8
  float clipped;                 ///< SPEC 4.4
  /// SampledImage, after which a row and kReadBeyond more pixels follow; in its pixels, the centre
  /// of the first at 0, a grid position is at image_per_sample * position + image_offset.
  const std::uint32_t* rgba;
  bool masked;  ///< some colours may be asked for whose four pixels are all masked
  int width_px, height_px;
  float image_per_sample[2], image_offset[2];
};

/// A row of the image.
struct PixelRow {
  int width_px;
  float inverse_fx, inverse_fy, cx, cy;  ///< of the novel camera, pixels
  float y;                               ///< of the row's centre, pixels
  float pixel_angle_rad;                 ///< t_pixel of SPEC 4.5
  float least_inverse_depth;             ///< SPEC 4.5: t of farther points is taken there
  BlendWeight blend;                     ///< and its parameters, as BlendParameters has them
  float exponent, falloff, max_angle_rad;
  int blend_k;
  /// Weights are compared as logarithms, of angles to float32's last digits: where `inverse-angle`
  /// does not fit float32, or an exponent multiplies what an angle is off by.
  bool precise_weights;
  int nearest_views;     ///< SPEC 1.3: K and max_angle hold at the point; 0: the sphere rule
  float absolute_delta;  ///< the report's Delta, scene units; negative: that of each view
  bool clipped;          ///< RenderFrame::AnyClipped
  const float* linear;   ///< linear light of each 8-bit sRGB value, to blend in it; null: in sRGB
  const float* surface;  ///< SPEC 5.1: 1/z; 0: none
  // What SPEC 6 asks for.
  std::uint32_t* image;  ///< RGBA, sRGB, alpha 255 where seen
  float* depth;          ///< plane z, 0 where unseen
  std::uint32_t* marks;  ///< views blended; from bit 8 on 255 at the Delta border
};

/// The vector instructions that this machine has for it, as Highway calls them.
const char* InstructionSet();

/// SPEC 5.2, 5.3 and 4.2 to 4.8; views in canonical order.
void ResolvePixelRow(const PixelRow& row, std::span<const PixelView> views);

}  // namespace dtr::simd
