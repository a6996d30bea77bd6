// dtr/base/random.h -- random numbers that depend on names, not on history.
#pragma once
#include <cmath>
#include <cstdint>
#include <numbers>

namespace dtr {

/// A well-mixed 64-bit hash of a 64-bit value (the SplitMix64 finaliser; Steele, Lea, Flood 2014).
constexpr std::uint64_t HashBits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Hash of a chain of values: the same names give the same number on any thread, in any order.
template <typename... Rest>
constexpr std::uint64_t HashOf(std::uint64_t first, Rest... rest) {
  std::uint64_t h = HashBits(first);
  ((h = HashBits(h ^ static_cast<std::uint64_t>(rest))), ...);
  return h;
}

/// Uniform in [0, 1), from the upper 53 bits of a hash.
constexpr double UniformFromHash(std::uint64_t hash) {
  return static_cast<double>(hash >> 11) * 0x1.0p-53;
}

/// A seeded sequence for tests and set-up code; cheap to copy, the same on every platform.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(HashBits(seed)) {}
  std::uint64_t Bits() { return HashBits(state_++); }
  double Uniform() { return UniformFromHash(Bits()); }
  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }
  /// Uniform integer in [0, count); requires count > 0.
  int Index(int count) { return static_cast<int>(Uniform() * count); }
  /// Standard normal (Box-Muller).
  double Normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * Uniform());
  }

 private:
  std::uint64_t state_;
};

}  // namespace dtr
