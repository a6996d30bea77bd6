// dtr/io/alpha.h -- internal to dtr/io: what the alpha channel of a photo means.
#pragma once
#include <cstdint>
#include <filesystem>
#include <vector>

#include "dtr/io/image_codecs.h"
#include "dtr/io/image_io.h"
#include "dtr/types/grid.h"

namespace dtr::io {

/// The index of the alpha channel, -1 for an image without one.
int AlphaChannelOf(const ImageFacts& facts);

/// The alpha of an image, as a coverage from 0 (transparent) to 1 (opaque).
class Alpha {
 public:
  /// Of an image without alpha, or opaque throughout.
  Alpha() = default;
  /// Throws Error when the pixels cannot be read or hold NaN.
  Alpha(OpenedImage& in, const std::filesystem::path& file);

  /// Divides premultiplied colours by alpha and makes transparent pixels black, in the values that
  /// the file stores: linear light in float files, coded values in others. Straight colours of
  /// pixels that are not transparent stay as they are. `channels` values a pixel.
  void Straighten(std::vector<float>& values, int channels) const;
  void Straighten(std::vector<std::uint8_t>& values, int channels) const;

  /// 255 where alpha is at least one half: there most of the light is the object's. Empty where
  /// all of it is usable.
  Mask Usable() const;

  /// Formats that may compress alpha with loss (WebP, HEIF) have a tolerance of 3 % at both ends.
  const AlphaCounts& counts() const { return counts_; }

 private:
  template <typename T>
  void StraightenAs(std::vector<T>& values, int channels, float most) const;

  Grid<float> values_;  // empty: opaque
  bool premultiplied_ = false;
  AlphaCounts counts_;
};

/// Gives pixels where `usable` is 0 colours that continue those around them smoothly (averages of
/// ever coarser grids, as in push-pull), so that no filter or feature finds an edge or a hidden
/// colour there. Leaves an image without a usable pixel as it is.
void FillUnusable(ImageRgb8& image, const Mask& usable);

}  // namespace dtr::io
