#include "dtr/io/colour_coding.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace dtr::io {
namespace {

constexpr double kReferenceWhite = 203;                   // cd/m2, ITU-R BT.2408
constexpr double kHlgPeak = 1000, kHlgSystemGamma = 1.2;  // ITU-R BT.2100's nominal display
constexpr float kLargestLight = 1e30F;                    // products with matrices stay finite
constexpr float kKnee = 0.8F;                             // of reference white
constexpr size_t kNumbers = 65536;

Eigen::Vector3d Xyz(const Eigen::Vector2d& xy) {
  return {xy.x() / xy.y(), 1, (1 - xy.x() - xy.y()) / xy.y()};
}

// SMPTE RP 177: columns are the primaries, scaled so that equal parts give white.
Eigen::Matrix3d XyzFromRgb(const Primaries& primaries) {
  Eigen::Matrix3d columns;
  columns << Xyz(primaries.red), Xyz(primaries.green), Xyz(primaries.blue);
  return columns * (columns.inverse() * Xyz(primaries.white)).asDiagonal();
}

// Bradford's cone responses, as ICC profiles use them.
Eigen::Matrix3d Adaptation(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  if (from == to) return Eigen::Matrix3d::Identity();
  Eigen::Matrix3d cones;
  cones << 0.8951, 0.2664, -0.1614, -0.7502, 1.7135, 0.0367, 0.0389, -0.0685, 1.0296;
  const Eigen::Vector3d gain = (cones * Xyz(to)).cwiseQuotient(cones * Xyz(from));
  return cones.inverse() * gain.asDiagonal() * cones;
}

Eigen::Matrix3d SrgbFrom(const Primaries& primaries) {
  const Primaries srgb;
  return XyzFromRgb(srgb).inverse() * Adaptation(primaries.white, srgb.white) *
         XyzFromRgb(primaries);
}

double LightOfSrgb(double number) {
  return number <= 0.04045 ? number / 12.92 : std::pow((number + 0.055) / 1.055, 2.4);
}

double LightOfPq(double number) {  // ITU-R BT.2100, table 4, in cd/m2
  constexpr double m1 = 2610.0 / 16384, m2 = 2523.0 / 4096 * 128;
  constexpr double c1 = 3424.0 / 4096, c2 = 2413.0 / 4096 * 32, c3 = 2392.0 / 4096 * 32;
  const double power = std::pow(number, 1 / m2);
  return 10000 * std::pow(std::max(power - c1, 0.0) / (c2 - c3 * power), 1 / m1);
}

double LightOfHlg(double number) {  // ITU-R BT.2100, table 5: of the scene, 0..1
  constexpr double a = 0.17883277, b = 1 - 4 * a;
  const double c = 0.5 - a * std::log(4 * a);
  return number <= 0.5 ? number * number / 3 : (std::exp((number - c) / a) + b) / 12;
}

// What is brighter than the knee approaches 1.
float CompressedLight(float light) {
  if (light <= kKnee) return light;
  return kKnee + (1 - kKnee) * (1 - std::exp((kKnee - light) / (1 - kKnee)));
}

struct Codes {
  std::vector<std::uint8_t> of_light;
  Codes() : of_light(kNumbers) {
    for (size_t i = 0; i < kNumbers; ++i) {
      of_light[i] = Srgb8FromLinear(static_cast<double>(i) / (kNumbers - 1));
    }
  }
};

std::optional<Primaries> PrimariesOf(int h273) {
  const Eigen::Vector2d d65{0.3127, 0.3290};
  switch (h273) {
    case 1:
    case 2:  // unspecified
    case 5:
    case 6:
    case 7:  // of television before HD: so near that nobody converts them
      return Primaries{};
    case 9:
      return Primaries{{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, d65};
    case 11:
      return Primaries{{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, {0.314, 0.351}};
    case 12:
      return Primaries{{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, d65};
    default:
      return {};
  }
}

}  // namespace

std::uint8_t Srgb8FromLinear(double linear) {
  const double v = std::clamp(linear, 0.0, 1.0);
  const double coded = v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(coded * 255));
}

std::optional<ColourCoding> CodingOfH273(int primaries, int transfer) {
  const auto known = PrimariesOf(primaries);
  if (!known) return {};
  ColourCoding coding;
  coding.primaries = *known;
  switch (transfer) {
    case 1:
    case 2:
    case 6:
    case 7:
    case 11:
    case 12:
    case 13:
    case 14:
    case 15:
      return coding;
    case 4:
      coding.transfer = Transfer::kGamma;
      coding.gamma = 2.2;
      return coding;
    case 5:
      coding.transfer = Transfer::kGamma;
      coding.gamma = 2.8;
      return coding;
    case 8:
      coding.transfer = Transfer::kLinear;
      return coding;
    case 16:
      coding.transfer = Transfer::kPq;
      return coding;
    case 18:
      coding.transfer = Transfer::kHlg;
      return coding;
    default:
      return {};
  }
}

bool IsHdr(const ColourCoding& coding) {
  return coding.transfer == Transfer::kPq || coding.transfer == Transfer::kHlg;
}

double LightOf(const ColourCoding& coding, double number) {
  switch (coding.transfer) {
    case Transfer::kSrgb:
      return LightOfSrgb(number);
    case Transfer::kLinear:
      return number;
    case Transfer::kGamma:
      return std::pow(number, coding.gamma);
    case Transfer::kPq:
      return LightOfPq(number) / kReferenceWhite;
    default:
      return LightOfHlg(number) * kHlgPeak / kReferenceWhite;
  }
}

SrgbConverter::SrgbConverter(const ColourCoding& coding) : coding_(coding), light_(kNumbers) {
  const Eigen::Matrix3d matrix = SrgbFrom(coding.primaries);
  const bool positive = std::isfinite(coding.gamma) && coding.gamma > 0;
  if (!matrix.allFinite() || !positive) throw std::invalid_argument("SrgbConverter: coding");
  srgb_from_coded_ = matrix.cast<float>();
  for (size_t i = 0; i < kNumbers; ++i) {
    light_[i] = static_cast<float>(LightOf(coding, static_cast<double>(i) / (kNumbers - 1)));
  }
}

void SrgbConverter::Finish(Eigen::Vector3f light, std::uint8_t* srgb) const {
  static const Codes kCodes;
  // Within what the products below can hold: infinity less infinity would be no number.
  light = light.cwiseMin(kLargestLight).cwiseMax(-kLargestLight);
  light = (srgb_from_coded_ * light).cwiseMax(0);
  if (IsHdr(coding_)) {
    const float largest = light.maxCoeff();
    if (largest > kKnee) light *= CompressedLight(largest) / largest;
  }
  for (int c = 0; c < 3; ++c) {
    const float clipped = std::min(light[c], 1.0F);
    srgb[c] = kCodes.of_light[static_cast<size_t>(clipped * (kNumbers - 1) + 0.5F)];
  }
}

void SrgbConverter::Convert(const std::uint16_t* rgb, size_t pixels, std::uint8_t* srgb) const {
  // ITU-R BT.2020's and BT.2100's luminance, of the light of the scene, before HLG's system gamma.
  const Eigen::Vector3f luma(0.2627F, 0.6780F, 0.0593F);
  const auto peak = static_cast<float>(kHlgPeak / kReferenceWhite);
  for (size_t i = 0; i < 3 * pixels; i += 3) {
    Eigen::Vector3f light(light_[rgb[i]], light_[rgb[i + 1]], light_[rgb[i + 2]]);
    if (coding_.transfer == Transfer::kHlg) {
      const float luminance = luma.dot(light) / peak;
      light *= std::pow(luminance, static_cast<float>(kHlgSystemGamma - 1));
    }
    Finish(light, srgb + i);
  }
}

void SrgbConverter::ConvertLinear(const float* rgb, size_t pixels, std::uint8_t* srgb) const {
  for (size_t i = 0; i < 3 * pixels; i += 3) {
    Finish(Eigen::Vector3f(rgb[i], rgb[i + 1], rgb[i + 2]), srgb + i);
  }
}

}  // namespace dtr::io
