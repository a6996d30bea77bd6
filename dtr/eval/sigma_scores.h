// dtr/eval/sigma_scores.h -- is a stated standard deviation honest?
#pragma once
#include <optional>
#include <vector>

namespace dtr::eval {

/// How well stated standard deviations describe errors. Empty: there was no pixel to evaluate.
struct SigmaScores {
  /// Share of errors inside 1, 2, 3 standard deviations; 0.683, 0.954, 0.997 for normal errors.
  std::optional<double> share_within_1_sigma, share_within_2_sigma, share_within_3_sigma;
  /// Area under the sparsification curve (mean error of what is left as ever more pixels of the
  /// largest sigma are removed) over the area when the largest errors are removed instead: 1 for a
  /// perfect order (Ilg et al., ECCV 2018, sec. 4.1, as a ratio). Empty where no error exceeds 0.
  std::optional<double> sparsification_ratio;
  /// The same ratio if the errors were normal with the stated sigmas: what honest sigmas can reach.
  /// Chance alone puts a normal error out of the order of its sigma; 2.32 where all sigmas are
  /// equal.
  std::optional<double> sparsification_ratio_if_normal;
  /// Share of outliers among the tenth, two tenths, ... all of the pixels that have the least
  /// sigmas (the curve of Hu and Mordohai, PAMI 2012, sec. 4.2, of outliers in the place of
  /// errors); empty where there is no pixel.
  std::vector<double> outlier_share_by_tenth;
};

/// Gathers any number of errors in constant memory: logarithmic bins of 1/32 octave stand for exact
/// order, which moves an area by less than 1 %.
class SigmaScorer {
 public:
  SigmaScorer();
  /// `error` >= 0 and `sigma` > 0 in one unit, the same in all calls. Anything else is rejected
  /// with std::invalid_argument. `outlier`: whoever adds the error calls it one.
  void Add(double error, double sigma, bool outlier);
  SigmaScores Scores() const;

 private:
  struct Bin {
    long long count = 0;
    long long outliers = 0;
    double error_sum = 0;
  };
  /// Of pixels in the order of their bins: their count, and the sum of their errors.
  struct Errors {
    double count = 0, sum = 0;
  };
  static double Area(const std::vector<Errors>& bins);
  static std::vector<Errors> ErrorsOf(const std::vector<Bin>& bins);
  /// Normal errors with the sigmas that were added, in the order of the sigmas and by their size.
  std::vector<Errors> NormalBySigma() const;
  std::vector<Errors> NormalBySize() const;
  std::vector<double> OutliersByTenth() const;

  std::vector<Bin> by_sigma_, by_error_;
  long long count_ = 0;
  long long within_[3] = {0, 0, 0};
};

}  // namespace dtr::eval
