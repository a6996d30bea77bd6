// datasets/noise.h -- noise on a hashed lattice: the same everywhere, never repeating.
#pragma once
#include <Eigen/Core>
#include <cstdint>

namespace dtr::datasets {

/// Uniform in [-1, 1) from a lattice point and a seed. Cheap (a few multiplications), and good
/// enough for texture; not for statistics.
inline double LatticeValue(std::int32_t x, std::int32_t y, std::int32_t z, std::uint32_t seed) {
  std::uint32_t h = static_cast<std::uint32_t>(x) * 0x8da6b343u ^
                    static_cast<std::uint32_t>(y) * 0xd8163841u ^
                    static_cast<std::uint32_t>(z) * 0xcb1ab31fu ^ seed * 0x9e3779b9u;
  h ^= h >> 15;
  h *= 0x2c1b3c6du;
  h ^= h >> 12;
  h *= 0x297a2d39u;
  h ^= h >> 15;
  return static_cast<double>(static_cast<std::int32_t>(h)) * 0x1.0p-31;
}

/// Uniform in [0, 1), as LatticeValue.
inline double LatticeUniform(std::int32_t x, std::int32_t y, std::int32_t z, std::uint32_t seed) {
  return 0.5 + 0.5 * LatticeValue(x, y, z, seed);
}

/// Largest integer not above x; x must fit an int.
inline std::int32_t FloorToInt(double x) {
  const std::int32_t truncated = static_cast<std::int32_t>(x);
  return truncated - (x < truncated ? 1 : 0);
}

/// What a sum of octaves looks like. Octave k has wavelength / 2^k and amplitude gain^k.
struct OctaveNoise {
  double wavelength;   ///< of the first octave, scene units
  double gain = 0.7;   ///< 0.7 is close to the 1/f amplitude spectrum of photographs
  int octaves = 10;    ///< at most; finer ones than a pixel's footprint are left out
  std::uint32_t seed;  ///< two noises of different seeds are unrelated
};

/// Sum of octaves of smooth value noise, roughly in [-1, 1] and with zero mean. An octave fades out
/// between 3 and 1.5 wavelengths per `footprint` (scene units per pixel), since a pixel's area
/// averages it to zero: that is what keeps far surfaces free of aliasing.
double Noise2(const Eigen::Vector2d& p, const OctaveNoise& noise, double footprint);
double Noise3(const Eigen::Vector3d& p, const OctaveNoise& noise, double footprint);

}  // namespace dtr::datasets
