// Blend weights where they underflow, overflow or meet their ends.
#include <algorithm>
#include <numbers>

#include "cli/selftest/cases.h"
#include "dtr/base/random.h"
#include "dtr/render/blend_weights.h"

namespace dtr::selftest {
namespace {

constexpr const char* kBlendingStage = "Blending";
constexpr BlendWeight kWeights[] = {BlendWeight::kCosine, BlendWeight::kExponential,
                                    BlendWeight::kAngle, BlendWeight::kInverseAngle,
                                    BlendWeight::kKNearest};

/// What shares must be, over many draws.
class Shares {
 public:
  void Draw(const BlendParameters& parameters, const std::vector<double>& angles_rad,
            Outcome& outcome) {
    std::vector<double> shares(angles_rad.size());
    BlendShares(parameters, angles_rad, shares);
    outcome.LookAtAll(shares);
    double sum = 0;
    for (size_t i = 0; i < shares.size(); ++i) {
      sum += shares[i];
      out_of_order_ += !(shares[i] >= 0);
      for (size_t j = 0; j < i; ++j) {
        out_of_order_ += angles_rad[i] < angles_rad[j] && !(shares[i] >= shares[j]);
        unequal_ += angles_rad[i] == angles_rad[j] && shares[i] != shares[j];
      }
    }
    worst_sum_ = std::max(worst_sum_, std::isfinite(sum) ? std::abs(sum - 1) : 1e300);
  }
  void AddTo(Outcome& outcome) const {
    outcome.Add(
        AtMost("largest |sum of the shares - 1|", worst_sum_, 1e-12, "256 roundings of doubles"));
    outcome.Add(Exactly("pairs where the farther view counts more", out_of_order_, 0,
                        "every weight falls with the angle"));
    outcome.Add(Exactly("pairs at equal angles with unequal shares", unequal_, 0,
                        "equal views count equally"));
  }

 private:
  double worst_sum_ = 0;
  double out_of_order_ = 0, unequal_ = 0;
};

std::vector<double> RandomAngles(int count, double most, Random& random) {
  std::vector<double> angles;
  for (int i = 0; i < count; ++i) angles.push_back(random.Uniform(0, most));
  return angles;
}

BlendParameters Of(BlendWeight blend) {
  BlendParameters p;
  p.blend = blend;
  p.max_angle_rad = std::numbers::pi / 3;
  return p;
}

Outcome CosinePowers() {
  Outcome outcome;
  Shares shares;
  Random random(1);
  BlendParameters p = Of(BlendWeight::kCosine);
  for (const double n : {0.01, 1.0, 8.0, 100.0, 1000.0}) {
    p.exponent = n;
    for (int k = 0; k < 200; ++k)
      shares.Draw(p, RandomAngles(8, std::numbers::pi, random), outcome);
    shares.Draw(p, {1.5, 1.56}, outcome);  // cos(1.5)^1000 = 1e-1151
  }
  shares.AddTo(outcome);
  return outcome;
}

Outcome Exponentials() {
  Outcome outcome;
  Shares shares;
  Random random(2);
  BlendParameters p = Of(BlendWeight::kExponential);
  for (const double c : {1e-3, 1.0, 1e3, 1e6}) {
    p.falloff = c;
    for (int k = 0; k < 200; ++k)
      shares.Draw(p, RandomAngles(8, std::numbers::pi, random), outcome);
  }
  shares.AddTo(outcome);
  return outcome;
}

Outcome ManyBlendedViews() {
  Outcome outcome;
  Shares shares;
  Random random(3);
  for (const BlendWeight weight : kWeights) {
    for (const double most : {1e-6, 0.5, std::numbers::pi}) {
      shares.Draw(Of(weight), RandomAngles(256, most, random), outcome);
    }
  }
  shares.AddTo(outcome);
  return outcome;
}

Outcome AllUnderflow() {
  Outcome outcome;
  Shares shares;
  double min_best = 1;
  for (const BlendWeight weight : kWeights) {
    BlendParameters p = Of(weight);
    p.exponent = 1000;
    p.falloff = 1e6;
    p.blend_k = weight == BlendWeight::kInverseAngle ? 1000 : 1;
    // Beyond the largest angle, and so far apart that only one logarithm does not underflow.
    const std::vector<double> angles = {3.0, 1.2, 2.0};
    shares.Draw(p, angles, outcome);
    std::vector<double> found(angles.size());
    BlendShares(p, angles, found);
    min_best = std::min(min_best, found[1]);
  }
  shares.AddTo(outcome);
  outcome.Add(AtLeast("smallest share of the best view", min_best, 1 - 1e-12,
                      "where all weights are 0 in doubles, the nearest view is what is left"));
  return outcome;
}

Outcome Duplicates() {
  Outcome outcome;
  Shares shares;
  Random random(4);
  for (const BlendWeight weight : kWeights) {
    for (int k = 0; k < 100; ++k) {
      const std::vector<double> one = RandomAngles(4, 1.5, random);
      const std::vector<double> angles = {one[0], one[1], one[2], one[3], one[0], one[0], one[2]};
      shares.Draw(Of(weight), angles, outcome);
    }
  }
  shares.AddTo(outcome);
  return outcome;
}

Outcome ZeroAndStraightBehind() {
  Outcome outcome;
  Shares shares;
  for (const BlendWeight weight : kWeights) {
    for (const double max_angle : {1e-3, std::numbers::pi}) {
      BlendParameters p = Of(weight);
      p.max_angle_rad = max_angle;
      for (const std::vector<double>& angles :
           std::vector<std::vector<double>>{{0, std::numbers::pi},
                                            {0, 0, 0},
                                            {std::numbers::pi, std::numbers::pi},
                                            {0},
                                            {std::numbers::pi},
                                            {5e-324, 0}}) {
        shares.Draw(p, angles, outcome);
      }
    }
  }
  shares.AddTo(outcome);
  return outcome;
}

}  // namespace

std::vector<Case> BlendingCases() {
  return {{kBlendingStage, "cos^n, n to 1000", true, CosinePowers},
          {kBlendingStage, "exponential, c to 1e6", true, Exponentials},
          {kBlendingStage, "256 views", true, ManyBlendedViews},
          {kBlendingStage, "all weights underflow", true, AllUnderflow},
          {kBlendingStage, "duplicate cameras", true, Duplicates},
          {kBlendingStage, "angles of 0 and 180 degrees", true, ZeroAndStraightBehind}};
}

}  // namespace dtr::selftest
