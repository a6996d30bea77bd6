// tests/cli/gps_photo.h -- photos that say where they were taken.
#pragma once
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>

#include "dtr/types/grid.h"

namespace dtr::testing {

/// A JPEG taken `at` metres east (not below 0), north (not below 0) and up of 55.7 N, 13.2 E, 37 m;
/// within 50 m of there the Earth is flat to a millimetre. `error_m`: what EXIF says of it.
inline void WritePhotoAt(const std::filesystem::path& file, const Eigen::Vector3d& at,
                         std::optional<double> error_m = {},
                         const ImageRgb8& image = ImageRgb8(2, 2, 3)) {
  constexpr double kDegree = std::numbers::pi / 180;
  constexpr double kMeridianM = 6379141, kParallelM = 6392793;  // radii of WGS 84 there, and 37 m
  // EXIF is written from float: whole degrees and minutes leave the seconds their digits.
  const auto parts = [](double degrees, double minutes, double seconds) {
    return std::array{static_cast<float>(degrees), static_cast<float>(minutes),
                      static_cast<float>(seconds)};
  };
  const auto latitude = parts(55, 42, 3600 * at.y() / kMeridianM / kDegree);
  const auto longitude =
      parts(13, 12, 3600 * at.x() / (kParallelM * std::cos(55.7 * kDegree)) / kDegree);
  const OIIO::TypeDesc three(OIIO::TypeDesc::FLOAT, 3);
  OIIO::ImageSpec spec(image.width(), image.height(), 3, OIIO::TypeDesc::UINT8);
  spec.attribute("GPS:LatitudeRef", "N");
  spec.attribute("GPS:Latitude", three, latitude.data());
  spec.attribute("GPS:LongitudeRef", "E");
  spec.attribute("GPS:Longitude", three, longitude.data());
  spec.attribute("GPS:Altitude", static_cast<float>(37 + at.z()));
  if (error_m) spec.attribute("GPS:HPositioningError", static_cast<float>(*error_m));
  const auto out = OIIO::ImageOutput::create(file.string());
  ASSERT_TRUE(out && out->open(file.string(), spec));
  ASSERT_TRUE(out->write_image(OIIO::TypeDesc::UINT8, image.data().data()) && out->close());
}

}  // namespace dtr::testing
