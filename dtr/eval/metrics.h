// dtr/eval/metrics.h -- how far a rendering is from a photo. docs/ACCURACY.md.
#pragma once
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dtr/types/grid.h"

namespace dtr::eval {

/// Sums over compared pixels, so that figures over several masks or images can be pooled.
struct SquaredError {
  double sum = 0;         ///< of squared differences of 8-bit values, over pixels and channels
  long long samples = 0;  ///< pixels times channels
};

/// Squared 8-bit sRGB differences over the pixels where `mask` is not 0 (an empty mask: all).
/// Throws std::invalid_argument unless both images and the mask have one size and 3 channels.
SquaredError CompareSquared(const ImageRgb8& image, const ImageRgb8& reference, const Mask& mask);

/// Peak signal-to-noise ratio in dB, RGB together, 8-bit sRGB, peak 255: 10 log10(255^2 / MSE).
/// Infinite for identical pixels (JSON shows it as null), empty when `mask`
/// leaves no pixel. Sizes as for CompareSquared.
std::optional<double> Psnr(const ImageRgb8& image, const ImageRgb8& reference, const Mask& mask);

/// The same after the gain and offset of each channel of `image` that fit best (least squares over
/// the pixels that count, values not clamped): what is left is no difference of exposure or white
/// balance. At least Psnr.
std::optional<double> ColourCorrectedPsnr(const ImageRgb8& image, const ImageRgb8& reference,
                                          const Mask& mask);

/// Names of those that are infinite. Programs that read JSON tell by it "all pixels are equal" from
/// "no pixel to compare", as both are null there.
std::vector<std::string> IdenticalFigures(
    std::initializer_list<std::pair<const char*, std::optional<double>>> psnrs_db);

/// Structural similarity: mean over windows and over the three channels of the SSIM index with an
/// 11x11 Gaussian window of sigma 1.5, K1 = 0.01, K2 = 0.03, L = 255 (Wang, Bovik, Sheikh,
/// Simoncelli, "Image quality assessment: from error visibility to structural similarity", IEEE
/// TIP 2004, eq. 13). As in the authors' reference, only windows that lie in the image count
/// ('valid'), and nothing is downsampled. With a mask, only windows free of masked pixels count.
/// Empty when no window is left. The result does not depend on `threads` (0: all cores).
std::optional<double> Ssim(const ImageRgb8& image, const ImageRgb8& reference, const Mask& mask);

/// 255 where both masks are; an empty mask is all 255. Sizes must agree (std::invalid_argument).
Mask Intersect(const Mask& a, const Mask& b);

/// Share of `mask` pixels that are not 0, within those of `within` that are not 0 (empty: all).
/// 0 when `within` leaves no pixel.
double ShareOf(const Mask& mask, const Mask& within);

}  // namespace dtr::eval
