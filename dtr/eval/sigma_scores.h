// dtr/eval/sigma_scores.h -- is a stated standard deviation honest?
#pragma once
#include <optional>
#include <vector>

namespace dtr::eval {

/// How well stated standard deviations describe errors. Empty: there was no pixel to judge.
struct SigmaScores {
  /// Share of errors inside 1, 2, 3 standard deviations; 0.683, 0.954, 0.997 for normal errors.
  std::optional<double> share_within_1_sigma, share_within_2_sigma, share_within_3_sigma;
  /// Area under the sparsification curve (mean error of what is left as ever more pixels of the
  /// largest sigma are removed) over the area when the largest errors are removed instead: 1 for a
  /// perfect order (Ilg et al., ECCV 2018, sec. 4.1, as a ratio). Empty where no error exceeds 0.
  std::optional<double> sparsification_ratio;
};

/// Gathers any number of errors in constant memory: logarithmic bins of 1/32 octave stand for exact
/// order, which moves an area by less than 1 %.
class SigmaScorer {
 public:
  SigmaScorer();
  /// `error` >= 0 and `sigma` > 0 in one unit, the same in all calls. Anything else is refused with
  /// std::invalid_argument.
  void Add(double error, double sigma);
  SigmaScores Scores() const;

 private:
  struct Bin {
    long long count = 0;
    double error_sum = 0;
  };
  static double Area(const std::vector<Bin>& bins);

  std::vector<Bin> by_sigma_, by_error_;
  long long count_ = 0;
  long long within_[3] = {0, 0, 0};
};

}  // namespace dtr::eval
