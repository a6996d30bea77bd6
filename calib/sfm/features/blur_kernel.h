// calib/sfm/features/blur_kernel.h -- separable Gaussian blur with the processor's vector
// instructions.
#pragma once
#include <array>
#include <vector>

namespace dtr::sfm {

constexpr int kMaxBlurRadius = 15;
/// Rows that are blurred at once: those and the ones around them stay in the processor's cache.
constexpr int kBlurRows = 16;

/// One half of a symmetric filter: `weight[0]` of the centre, `weight[i]` of both at distance i.
struct Taps {
  int radius = 0;
  std::array<float, kMaxBlurRadius + 1> weight{};
};

/// A Gaussian of standard deviation `sigma` in pixels, sampled; its weights add up to 1.
/// Requires 0 < sigma <= 4.
Taps GaussianTaps(double sigma);

/// Filters that give an image at twice its size: samples at pixel centres by `even`, those halfway
/// between by `odd`, whose weight[i] is that of both pixels at distance i + 1/2.
struct DoublingTaps {
  Taps even, odd;
};

/// Linear interpolation at twice the size, then a Gaussian of `sigma` in pixels of the doubled
/// image, as one filter. Requires 0 < sigma <= 4.
DoublingTaps LinearDoublingTaps(double sigma);

/// Memory of the two functions below for rows of `width` values.
class BlurScratch {
 public:
  explicit BlurScratch(int width);
  float* row(int i) { return values_.data() + static_cast<std::size_t>(i) * stride_ + kPad; }
  static constexpr int kPad = 16;  ///< values before and behind a row: kMaxBlurRadius and more
  static_assert(kPad > kMaxBlurRadius);

 private:
  std::size_t stride_;
  std::vector<float> values_;
};

/// Blurs `count` <= kBlurRows rows, those of `rows` from index `taps.radius` on; `rows` has
/// count + 2 radius. Beyond the left and the right border the last pixel repeats.
void BlurRows(const float* const* rows, int count, int width, const Taps& taps,
              BlurScratch* scratch, float* const* out);

/// Row `phase` (0: at pixel centres, 1: half a pixel below) of an image at twice its size.
/// `rows`: even.radius above the pixel row, the row itself, even.radius below; `width` is the
/// source's, `out` has twice as many values.
void DoubleRow(const float* const* rows, int phase, int width, const DoublingTaps& taps,
               BlurScratch* scratch, float* out);

/// out[i] = b[i] - a[i].
void SubtractRow(const float* a, const float* b, int width, float* out);

}  // namespace dtr::sfm
