// stereo/prior_agreement.h -- how depth of another instrument agrees with what the photos say.
#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "dtr/types/depth_image.h"
#include "dtr/types/sparse_scene.h"
#include "stereo/depth_prior.h"
#include "stereo/engine.h"

namespace dtr::stereo {

/// Points of like distance. `bias` and `noise` (standard deviation) are relative to z.
struct PriorBin {
  double near_z = 0, far_z = 0;
  int points = 0;
  double bias = 0, noise = 0;
};

/// The map of one view against the points that the view observes.
struct ViewPrior {
  int view = 0;
  int points = 0;
  double ratio = 1;     ///< median of z of the map over z of the points
  double noise = 0;     ///< standard deviation of that, relative, from the median deviation
  double outliers = 0;  ///< share of the points that are off by 10 % and four times that
  enum class Fit {
    kFits,
    kFewPoints,  ///< not enough to check this view alone
    kDiffers,    ///< from the other views' maps: its ratio, its noise or its outliers
  } fit = Fit::kFits;
};

/// All maps. Ratios are z of the map over z of the points; what they are taken from are points that
/// structure from motion triangulated in several photos, off depth edges of the map.
struct PriorAgreement {
  int points = 0;
  double scale = 1;                   ///< median ratio of the views that fit
  double scale_sigma = 0;             ///< its standard deviation, relative: by points and by views
  double noise = 0;                   ///< of a view that fits, in the median, relative
  double outliers = 0;                ///< the same
  std::vector<PriorBin> by_distance;  ///< rising; after division by `scale`
  std::vector<ViewPrior> views;       ///< those that have a map
  /// By how much the maps must be moved to fit the photos best, in shares of the image's width
  /// (both axes); 0 where no move fits clearly better.
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  /// For DepthPrior: noise and remaining bias together. Empty without bins.
  RelativeNoise expected;

  int Count(ViewPrior::Fit fit) const;
};

/// Fewer points than this say nothing of a view; of the whole, nothing of the scale.
inline constexpr int kMinPriorPoints = 12, kMinPriorPointsInAll = 50;
/// Maps with more noise or outliers than this do not show what the photos show. Half of a mirrored
/// map may agree by chance, as a floor does: its median deviation is small.
inline constexpr double kMaxPriorNoise = 0.15, kMaxPriorOutliers = 0.2;

/// Measures the maps that `load` gives (empty: the view has none) against `scene`.
///
/// Medians and median deviations throughout: matches at depth edges and wrong points are no news. A
/// view differs from the others when its ratio is off the median view's by more than 3 % and four
/// times the noise, its noise is more than four times the median view's and 3 %, or its outliers
/// are more than kMaxPriorOutliers and twice the median view's. The shift is the one with the least
/// mean deviation (cut off at 20 %) of the points' log ratios from their view's median, by
/// exhaustive search to 3.2 % of the width and a parabola; it counts where that deviation falls by
/// 15 % and in three quarters of the views. Deterministic. Throws std::invalid_argument when the
/// scene names a view or point that does not exist.
PriorAgreement MeasurePriors(std::span<const StereoView> views, const SparseScene& scene,
                             const std::function<std::optional<DepthImage>(int view)>& load);

}  // namespace dtr::stereo
