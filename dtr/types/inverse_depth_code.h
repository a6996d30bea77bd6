// dtr/types/inverse_depth_code.h -- 16-bit inverse depth (docs/FORMAT.md), as files and GPUs hold
// it.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

namespace dtr {

/// Codes of one map in n steps: 0 is a hole, c = 1...n + 1 stands for
/// 1/z = 1/far + (c - 1) / n * (1/near - 1/far); c = n + 1 is exactly near, c = 1 exactly far.
class InverseDepthCode {
 public:
  static constexpr int kSteps = 65534;  ///< the most that 16 bits hold

  /// Requires 0 < near_z < far_z < infinity (see IsRange) and 1 <= steps <= kSteps.
  InverseDepthCode(double near_z, double far_z, int steps = kSteps)
      : near_z_(near_z), far_z_(far_z), steps_(steps) {}
  static bool IsRange(double near_z, double far_z) {
    return near_z > 0 && near_z < far_z && std::isfinite(far_z);
  }

  /// Nearest code of a plane z > 0; depths off the range give its end.
  std::uint16_t Encode(float depth_z) const {
    const double share =
        std::clamp((1.0 / static_cast<double>(depth_z) - 1 / far_z_) / range(), 0.0, 1.0);
    return static_cast<std::uint16_t>(1 + std::lround(share * steps_));
  }

  /// Plane z of a code, at most n + 1; 0 for a hole.
  float Decode(std::uint16_t code) const {
    if (code == 0) return 0;
    // 1 / (1 / z) may miss z by an ulp; the ends of the range are exact by definition.
    if (code == 1) return static_cast<float>(far_z_);
    if (code == steps_ + 1) return static_cast<float>(near_z_);
    const double z = 1 / (1 / far_z_ + (code - 1) * range() / steps_);
    return static_cast<float>(std::clamp(z, near_z_, far_z_));
  }

  /// 1/z of code c >= 1 is first() + c * step().
  double step() const { return range() / steps_; }
  double first() const { return 1 / far_z_ - step(); }

 private:
  double range() const { return 1 / near_z_ - 1 / far_z_; }
  double near_z_, far_z_;
  int steps_;
};

}  // namespace dtr
