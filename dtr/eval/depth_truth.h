// dtr/eval/depth_truth.h -- how right a depth map is, by the truth.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "dtr/eval/edge_scores.h"
#include "dtr/eval/sigma_scores.h"
#include "dtr/types/camera.h"
#include "dtr/types/depth_image.h"
#include "dtr/types/grid.h"

namespace dtr::eval {

/// Figures over scored pixels: those with truth that the masks let through (visible in at least 2
/// other views, textured). Shares are of *all* scored pixels, so a hole counts as wrong; the
/// errors and outliers are of the kept ones. Empty: there was no such pixel.
struct DepthScores {
  long long truth_pixels = 0;                                  ///< scored pixels
  long long kept_pixels = 0;                                   ///< of them, with an estimated depth
  std::optional<double> share_within_1pct, share_within_2pct;  ///< |z - true z| / true z
  std::optional<double> share_within_half_px, share_within_1px,
      share_within_2px;  ///< of disparity: fx * reference baseline * |1/z - 1/true z|
  std::optional<double> depth_completeness;     ///< kept / scored
  std::optional<double> median_relative_error;  ///< of kept pixels
  std::optional<double> outlier_share;          ///< kept pixels with an error above 2 %
  std::optional<double> outlier_share_5pct;     ///< kept pixels with an error above 5 %
  /// Pixels of the image that have no true surface (sky) but an estimated depth.
  std::optional<double> share_estimated_without_truth;
  /// Pixels of completed depth that have a true surface, and their share within 5 % of it. All
  /// other figures are of measured depth.
  long long completed_pixels = 0;
  std::optional<double> completed_share_within_5pct;
  SigmaScores sigma;  ///< of kept pixels that state a standard deviation, errors in px of disparity
  EdgeScores edges;   ///< places of depth edges
};

/// Gathers the errors of any number of maps; figures over several pool their pixels.
class DepthScorer {
 public:
  /// Adds a map. `estimate` and `truth`: plane z on the *same* grid (truth is re-cast on the grid,
  /// never resampled; see SubsampleTruth). `scored`: which pixels count, empty: all with truth.
  /// `set_units_per_truth_unit`: what true depths are multiplied with, 1 for generator truth, else
  /// the scale of the similarity that aligns the truth's cameras with the set's.
  /// `px_per_inverse_depth`: fx of the depth grid's camera times the view's reference baseline, for
  /// the shares in pixels, the edges and the order of sigmas (0: those stay empty).
  /// `inverse_depth_sigma`: stated standard deviations of 1/z in set units, grid of `estimate`, 0
  /// where none is stated; null: the map states none.
  /// Throws Error when sizes or kinds differ or a factor is not positive and finite.
  void Add(const DepthImage& estimate, const DepthImage& truth, const Mask& scored,
           double set_units_per_truth_unit, double px_per_inverse_depth,
           const Grid<float>* inverse_depth_sigma = nullptr);

  DepthScores Scores() const;

 private:
  std::vector<float> relative_errors_;  // of kept pixels
  long long truth_pixels_ = 0, pixels_with_disparity_ = 0;
  long long within_half_px_ = 0, within_1px_ = 0, within_2px_ = 0;
  long long without_truth_ = 0, estimated_without_truth_ = 0;
  SigmaScorer sigma_;
  EdgeScorer edges_;
};

/// Truth on the grid of a depth map that is 1/s of the image per axis: the depth map's centre
/// s (i + 0.5) is the centre of a true pixel for odd s, which is taken. For even s it lies between
/// pixels, and interpolating truth would invent surfaces at silhouettes: Error, unless s is 1.
DepthImage SubsampleTruth(const DepthImage& truth, int s);
Mask SubsampleMask(const Mask& mask, int s);

/// True when both cameras have one size and intrinsics equal to 1e-6 px.
bool IsSameGrid(const PinholeCamera& truth, const PinholeCamera& view);

/// Throws Error unless both cameras have one size and intrinsics equal to 1e-6 px: depth maps of
/// different grids are not compared.
void RequireSameGrid(const PinholeCamera& truth, const PinholeCamera& view,
                     const std::string& name);

}  // namespace dtr::eval
