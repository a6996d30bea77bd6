// dtr/io/photo_colours.h -- internal: from the colours that a photo's file states to sRGB.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "dtr/io/image_codecs.h"

namespace dtr::io {

/// What a file states of its colours: an ICC profile, numbers (cICP, nclx), PNG's gAMA and cHRM,
/// EXR's chromaticities, EXIF's Adobe RGB. Converts to 8-bit sRGB, in one or three channels.
class PhotoColours {
 public:
  /// `format` as OpenImageIO names it, whatever the file is called. Throws Error with one line
  /// where the file's colours or windows are not supported.
  PhotoColours(const ImageFacts& facts, const std::string& format,
               const std::filesystem::path& file);
  ~PhotoColours();

  /// False where numbers are sRGB's already (or linear with sRGB's primaries, if they are floats).
  bool converts() const;
  /// Values of 0 to 1 (of float files: linear light), `channels` (1 or 3) of them a pixel, become
  /// 8-bit sRGB. Requires converts().
  void Convert(const std::vector<float>& values, int channels,
               std::vector<std::uint8_t>& srgb) const;

  /// One line for each thing that is stated and not applied.
  const std::vector<std::string>& remarks() const { return remarks_; }

 private:
  struct Conversion;
  std::unique_ptr<Conversion> conversion_;
  std::vector<std::string> remarks_;
};

}  // namespace dtr::io
