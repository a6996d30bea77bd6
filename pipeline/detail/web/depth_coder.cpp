#include "pipeline/detail/web/depth_coder.h"

#include <bit>
#include <cstdlib>
#include <vector>

#include "dtr/io/code_residuals.h"
#include "pipeline/detail/web/range_encoder.h"

namespace dtr::pipeline {
namespace {

// The same numbers stand in viewer/web/js/depth_codes.js.
constexpr int kClassNeighbours = 729;  // six of three classes
constexpr int kActivities = 16, kSides = 3;
constexpr int kMaxError = 64;  // of a neighbour, as far as it tells how rough a surface is
constexpr int kUnary = 14;     // larger residuals are Elias gamma codes of what is left
constexpr int kZero = 0, kNegative = 1, kMore = 2, kLength = kMore + kUnary, kModels = 36;
constexpr int kRough[] = {12, 16, 23, 32, 45, 64, 91};  // half octaves from 8 on

int ActivityLevel(int activity) {
  if (activity < 8) return activity;
  int level = 8;
  for (const int limit : kRough) level += activity >= limit ? 1 : 0;
  return level;
}

/// Per pixel: 0 no depth, 1 measured, 2 completed.
void EncodeClasses(const Grid<std::uint8_t>& classes, RangeEncoder& encoder) {
  std::vector<BitModel> models(2 * kClassNeighbours);
  const auto at = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < classes.width() ? classes(x, y) : 0;
  };
  for (int y = 0; y < classes.height(); ++y) {
    for (int x = 0; x < classes.width(); ++x) {
      size_t context = 0;
      for (const int c : {at(x - 1, y), at(x, y - 1), at(x - 1, y - 1), at(x + 1, y - 1),
                          at(x - 2, y), at(x, y - 2)}) {
        context = 3 * context + static_cast<size_t>(c);
      }
      const int here = classes(x, y);
      encoder.Put(models[2 * context], here == 1);
      if (here != 1) encoder.Put(models[2 * context + 1], here == 2);
    }
  }
}

void EncodeResidual(int residual, BitModel* models, RangeEncoder& encoder) {
  encoder.Put(models[kZero], residual != 0);
  if (residual == 0) return;
  encoder.Put(models[kNegative], residual < 0);
  const int magnitude = std::abs(residual) - 1;
  for (int k = 0; k < kUnary; ++k) {
    encoder.Put(models[kMore + k], magnitude > k);
    if (magnitude == k) return;
  }
  const auto rest = static_cast<std::uint32_t>(magnitude - kUnary + 1);
  const int length = std::bit_width(rest) - 1;
  for (int k = 0; k < length; ++k) encoder.Put(models[kLength + k], true);
  encoder.Put(models[kLength + length], false);
  encoder.PutPlain(rest, length);
}

/// Residuals of the prediction of code_residuals.h; how rough the surface is around chooses the
/// models. A hole is taken for what was predicted there.
void EncodeSurface(const Grid<std::uint16_t>& codes, RangeEncoder& encoder) {
  const int width = codes.width();
  std::vector<BitModel> models(static_cast<size_t>(kActivities * kSides * kModels));
  std::vector<int> row(static_cast<size_t>(width)), errors(static_cast<size_t>(width) + 1, 0);
  for (int y = 0; y < codes.height(); ++y) {
    int left = row[0], above_left = left, left_error = 0;
    for (int x = 0; x < width; ++x) {
      int& cell = row[static_cast<size_t>(x)];
      int& error = errors[static_cast<size_t>(x)];
      const int above = y == 0 ? left : cell;
      if (y == 0) above_left = left;
      const int above_right = y > 0 && x + 1 < width ? (&cell)[1] : above;
      const int predicted = io::PredictedCode(left, above, above_left);
      int value = predicted;
      if (codes(x, y) != 0) {
        value = codes(x, y);
        const int activity = std::abs(left - above_left) + std::abs(above - above_left) +
                             std::abs(above_right - above) + left_error + error + (&error)[1];
        const int side = left < above ? 0 : left == above ? 1 : 2;
        EncodeResidual(
            value - predicted,
            &models[static_cast<size_t>((ActivityLevel(activity) * kSides + side) * kModels)],
            encoder);
      }
      above_left = above;
      cell = left = value;
      error = left_error = std::min(std::abs(value - predicted), kMaxError);
    }
  }
}

}  // namespace

std::string EncodeDepthCodes(const Grid<std::uint16_t>& measured,
                             const Grid<std::uint16_t>& completed) {
  Grid<std::uint8_t> classes(measured.width(), measured.height());
  for (size_t p = 0; p < classes.data().size(); ++p) {
    const bool is_completed = !completed.empty() && completed.data()[p] != 0;
    classes.data()[p] = measured.data()[p] != 0 ? 1 : is_completed ? 2 : 0;
  }
  RangeEncoder encoder;
  EncodeClasses(classes, encoder);
  EncodeSurface(measured, encoder);
  if (!completed.empty()) EncodeSurface(completed, encoder);
  return encoder.Finish();
}

}  // namespace dtr::pipeline
