#include "dtr/eval/sigma_scores.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace dtr::eval {
namespace {

constexpr int kBinsPerOctave = 32;
constexpr int kOctaves = 120;  // 2^-60 to 2^60 pixels: all that a float32 depth can be wrong by

size_t BinOf(double value) {
  const double octave = value > 0 ? std::log2(value) : -kOctaves;
  const double bin = kBinsPerOctave * (octave + 0.5 * kOctaves);
  return static_cast<size_t>(std::clamp(bin, 0.0, kBinsPerOctave * kOctaves - 1.0));
}

}  // namespace

SigmaScorer::SigmaScorer()
    : by_sigma_(kBinsPerOctave * kOctaves), by_error_(kBinsPerOctave * kOctaves) {}

void SigmaScorer::Add(double error, double sigma) {
  if (!(error >= 0) || !(sigma > 0) || !std::isfinite(error) || !std::isfinite(sigma)) {
    throw std::invalid_argument("SigmaScorer: expected error >= 0 and sigma > 0, both finite");
  }
  ++count_;
  for (int k = 0; k < 3; ++k) within_[k] += error <= (k + 1) * sigma;
  for (const auto& [bins, key] : {std::pair(&by_sigma_, sigma), {&by_error_, error}}) {
    Bin& bin = (*bins)[BinOf(key)];
    ++bin.count;
    bin.error_sum += error;
  }
}

/// Integral over the share of pixels left, best first, of their mean error.
double SigmaScorer::Area(const std::vector<Bin>& bins) {
  long long left = 0;
  double sum = 0, area = 0, mean_before = 0;
  for (const Bin& bin : bins) {
    if (bin.count == 0) continue;
    if (left == 0) mean_before = bin.error_sum / static_cast<double>(bin.count);
    left += bin.count;
    sum += bin.error_sum;
    const double mean = sum / static_cast<double>(left);
    area += 0.5 * (mean_before + mean) * static_cast<double>(bin.count);
    mean_before = mean;
  }
  return area;
}

SigmaScores SigmaScorer::Scores() const {
  SigmaScores scores;
  if (count_ == 0) return scores;
  const auto share = [&](long long hits) {
    return static_cast<double>(hits) / static_cast<double>(count_);
  };
  scores.share_within_1_sigma = share(within_[0]);
  scores.share_within_2_sigma = share(within_[1]);
  scores.share_within_3_sigma = share(within_[2]);
  const double oracle = Area(by_error_);
  if (oracle > 0) scores.sparsification_ratio = Area(by_sigma_) / oracle;
  return scores;
}

}  // namespace dtr::eval
