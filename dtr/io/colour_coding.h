// dtr/io/colour_coding.h -- colours that are not sRGB's, and their conversion to sRGB.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace dtr::io {

/// Chromaticities x, y (CIE 1931) of the three primaries and of white.
struct Primaries {
  Eigen::Vector2d red{0.64, 0.33}, green{0.30, 0.60}, blue{0.15, 0.06};
  Eigen::Vector2d white{0.3127, 0.3290};
};

/// How numbers from 0 to 1 stand for light.
enum class Transfer {
  kSrgb,    ///< IEC 61966-2-1; also taken for video's BT.709, which displays show alike
  kLinear,  ///< proportional to light
  kGamma,   ///< light is the number to the power of `gamma`
  kPq,      ///< SMPTE ST 2084, HDR
  kHlg      ///< ARIB STD-B67, HDR
};

struct ColourCoding {
  Transfer transfer = Transfer::kSrgb;
  double gamma = 1;
  Primaries primaries;
};

/// By the numbers of ITU-T H.273, which videos, HEIF and PNG share; 2 (unspecified) is sRGB.
/// Nothing for those that are not supported.
std::optional<ColourCoding> CodingOfH273(int primaries, int transfer);

/// True for the two HDR codings.
bool IsHdr(const ColourCoding& coding);

/// Converts pixels to 8-bit sRGB: white is adapted by Bradford's matrix, colours outside of sRGB's
/// gamut are clipped. HDR is mapped so that its reference white, 203 cd/m2 (ITU-R BT.2408), comes
/// near white; what is brighter than 0.8 of it is compressed, by the largest channel, so that
/// hues stay. The mapping is the same for every pixel of every image: photos stay comparable.
class SrgbConverter {
 public:
  /// Throws std::invalid_argument where the primaries span no colours or gamma is not positive.
  explicit SrgbConverter(const ColourCoding& coding);

  /// `pixels` pixels of 3 numbers each, 0..65535.
  void Convert(const std::uint16_t* rgb, size_t pixels, std::uint8_t* srgb) const;
  /// Numbers already linear, of these primaries.
  void ConvertLinear(const float* rgb, size_t pixels, std::uint8_t* srgb) const;

 private:
  void Finish(Eigen::Vector3f light, std::uint8_t* srgb) const;

  ColourCoding coding_;
  Eigen::Matrix3f srgb_from_coded_;
  std::vector<float> light_;  // by number, of one channel
};

/// The light that a number stands for; of HDR relative to reference white, and of HLG before its
/// dependence on the pixel's luminance.
double LightOf(const ColourCoding& coding, double number);

/// sRGB-coded, 0..255; clipped.
std::uint8_t Srgb8FromLinear(double linear);

}  // namespace dtr::io
