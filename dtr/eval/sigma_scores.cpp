#include "dtr/eval/sigma_scores.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace dtr::eval {
namespace {

constexpr int kBinsPerOctave = 32;
constexpr size_t kTenths = 10;
constexpr double kMeanOfHalfNormal = 0.79788456080286536;  // sqrt(2 / pi), in its sigmas
constexpr int kOctaves = 120;  // 2^-60 to 2^60 pixels: all that a float32 depth can be wrong by

size_t BinOf(double value) {
  const double octave = value > 0 ? std::log2(value) : -kOctaves;
  const double bin = kBinsPerOctave * (octave + 0.5 * kOctaves);
  return static_cast<size_t>(std::clamp(bin, 0.0, kBinsPerOctave * kOctaves - 1.0));
}

double At(double bin) { return std::exp2(bin / kBinsPerOctave - 0.5 * kOctaves); }
double LowerEndOf(size_t bin) { return bin == 0 ? 0 : At(static_cast<double>(bin)); }
double MiddleOf(size_t bin) { return At(static_cast<double>(bin) + 0.5); }

}  // namespace

SigmaScorer::SigmaScorer()
    : by_sigma_(kBinsPerOctave * kOctaves), by_error_(kBinsPerOctave * kOctaves) {}

void SigmaScorer::Add(double error, double sigma, bool outlier) {
  if (!(error >= 0) || !(sigma > 0) || !std::isfinite(error) || !std::isfinite(sigma)) {
    throw std::invalid_argument("SigmaScorer: expected error >= 0 and sigma > 0, both finite");
  }
  ++count_;
  for (int k = 0; k < 3; ++k) within_[k] += error <= (k + 1) * sigma;
  for (const auto& [bins, key] : {std::pair(&by_sigma_, sigma), {&by_error_, error}}) {
    Bin& bin = (*bins)[BinOf(key)];
    ++bin.count;
    bin.outliers += outlier;
    bin.error_sum += error;
  }
}

/// Integral over the share of pixels left, best first, of their mean error.
double SigmaScorer::Area(const std::vector<Errors>& bins) {
  double left = 0, sum = 0, area = 0, mean_before = 0;
  for (const Errors& bin : bins) {
    if (!(bin.count > 0)) continue;
    if (left == 0) mean_before = bin.sum / bin.count;
    left += bin.count;
    sum += bin.sum;
    const double mean = sum / left;
    area += 0.5 * (mean_before + mean) * bin.count;
    mean_before = mean;
  }
  return area;
}

std::vector<SigmaScorer::Errors> SigmaScorer::ErrorsOf(const std::vector<Bin>& bins) {
  std::vector<Errors> errors;
  for (const Bin& bin : bins) errors.push_back({static_cast<double>(bin.count), bin.error_sum});
  return errors;
}

std::vector<SigmaScorer::Errors> SigmaScorer::NormalBySigma() const {
  std::vector<Errors> errors(by_sigma_.size());
  for (size_t bin = 0; bin < by_sigma_.size(); ++bin) {
    const auto count = static_cast<double>(by_sigma_[bin].count);
    errors[bin] = {count, count * kMeanOfHalfNormal * MiddleOf(bin)};
  }
  return errors;
}

std::vector<SigmaScorer::Errors> SigmaScorer::NormalBySize() const {
  std::vector<Errors> errors(by_error_.size());
  for (size_t sigma_bin = 0; sigma_bin < by_sigma_.size(); ++sigma_bin) {
    const auto count = static_cast<double>(by_sigma_[sigma_bin].count);
    if (count == 0) continue;
    const double sigma = MiddleOf(sigma_bin);
    // The distribution of a half-normal variable, and of its sum, between a bin's two ends; past
    // eight sigmas there is nothing.
    double share_below = 0, sum_below = 0;
    for (size_t bin = 0; bin < errors.size() && LowerEndOf(bin) < 8 * sigma; ++bin) {
      const double z = LowerEndOf(bin + 1) / sigma;
      const double share = std::erf(z / std::numbers::sqrt2);
      const double sum = sigma * kMeanOfHalfNormal * -std::expm1(-0.5 * z * z);
      errors[bin].count += count * (share - share_below);
      errors[bin].sum += count * (sum - sum_below);
      share_below = share;
      sum_below = sum;
    }
  }
  return errors;
}

std::vector<double> SigmaScorer::OutliersByTenth() const {
  std::vector<double> shares;
  double kept = 0, outliers = 0;
  for (const Bin& bin : by_sigma_) {
    // Pixels of one bin have one order only by chance: they are taken in shares of the bin.
    const auto count = static_cast<double>(bin.count), wrong = static_cast<double>(bin.outliers);
    while (shares.size() < kTenths) {
      const double wanted =
          static_cast<double>(count_) * (1.0 + static_cast<double>(shares.size())) / kTenths;
      if (wanted > kept + count) break;
      shares.push_back((outliers + wrong * (wanted - kept) / count) / wanted);
    }
    kept += count;
    outliers += wrong;
  }
  return shares;
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
  scores.outlier_share_by_tenth = OutliersByTenth();
  const double oracle = Area(ErrorsOf(by_error_));
  if (oracle > 0) scores.sparsification_ratio = Area(ErrorsOf(by_sigma_)) / oracle;
  scores.sparsification_ratio_if_normal = Area(NormalBySigma()) / Area(NormalBySize());
  return scores;
}

}  // namespace dtr::eval
