#include "datasets/noise.h"

#include <algorithm>

namespace dtr::datasets {
namespace {

// An octave is drawn fully from kFullPx pixels per wavelength on and left out below kGonePx.
constexpr double kFullPx = 3.0;
constexpr double kGonePx = 1.5;

double Smooth(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }
double Mix(double a, double b, double t) { return a + (b - a) * t; }

double ValueNoise2(double x, double y, std::uint32_t seed) {
  const std::int32_t i = FloorToInt(x), j = FloorToInt(y);
  const double u = Smooth(x - i), v = Smooth(y - j);
  return Mix(Mix(LatticeValue(i, j, 0, seed), LatticeValue(i + 1, j, 0, seed), u),
             Mix(LatticeValue(i, j + 1, 0, seed), LatticeValue(i + 1, j + 1, 0, seed), u), v);
}

double ValueNoise3(double x, double y, double z, std::uint32_t seed) {
  const std::int32_t i = FloorToInt(x), j = FloorToInt(y), k = FloorToInt(z);
  const double u = Smooth(x - i), v = Smooth(y - j), w = Smooth(z - k);
  double layers[2];
  for (int dk = 0; dk < 2; ++dk) {
    layers[dk] = Mix(
        Mix(LatticeValue(i, j, k + dk, seed), LatticeValue(i + 1, j, k + dk, seed), u),
        Mix(LatticeValue(i, j + 1, k + dk, seed), LatticeValue(i + 1, j + 1, k + dk, seed), u), v);
  }
  return Mix(layers[0], layers[1], w);
}

/// Calls octave(k, wavelength, weight) for every octave a pixel of this footprint can resolve.
template <typename Octave>
double SumOctaves(const OctaveNoise& noise, double footprint, const Octave& octave) {
  double sum = 0, amplitude = 1, wavelength = noise.wavelength;
  for (int k = 0; k < noise.octaves; ++k) {
    if (wavelength <= kGonePx * footprint) break;
    const double fade =
        std::min(1.0, (wavelength - kGonePx * footprint) / ((kFullPx - kGonePx) * footprint));
    sum += amplitude * fade * octave(static_cast<std::uint32_t>(k), 1.0 / wavelength);
    amplitude *= noise.gain;
    wavelength *= 0.5;
  }
  return sum;
}

}  // namespace

double Noise2(const Eigen::Vector2d& p, const OctaveNoise& noise, double footprint) {
  // Each octave is turned by about 37 degrees (a 3-4-5 triangle) against the one before, so that
  // the lattice directions do not add up to a visible weave.
  double x = p.x(), y = p.y();
  return SumOctaves(noise, footprint, [&](std::uint32_t k, double frequency) {
    const double turned = 0.8 * x - 0.6 * y;
    y = 0.6 * x + 0.8 * y;
    x = turned;
    return ValueNoise2(x * frequency, y * frequency, noise.seed + k);
  });
}

double Noise3(const Eigen::Vector3d& p, const OctaveNoise& noise, double footprint) {
  double x = p.x(), y = p.y(), z = p.z();
  return SumOctaves(noise, footprint, [&](std::uint32_t k, double frequency) {
    const double turned = 0.8 * x - 0.6 * y;
    y = 0.6 * x + 0.8 * y;
    x = 0.8 * turned - 0.6 * z;
    z = 0.6 * turned + 0.8 * z;
    return ValueNoise3(x * frequency, y * frequency, z * frequency, noise.seed + k);
  });
}

}  // namespace dtr::datasets
