// calib/scale.h -- how long one unit of a scene is: from measured distances, or from places on
// Earth.
#pragma once
#include <Eigen/Core>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/similarity.h"

namespace dtr::calib {

/// A distance between two points of a scene that somebody has measured.
struct MeasuredDistance {
  std::string name;                            ///< for errors
  Eigen::Vector3d a, b;                        ///< in the scene
  Eigen::Matrix3d covariance_a, covariance_b;  ///< scene units squared
  double length_m = 0;                         ///< > 0
  double sigma_m = 0;  ///< >= 0; 0: not stated, a thousandth of the length is assumed
};

/// A scale that is known worse says little more than an order of size.
inline constexpr double kMaxRelativeSigma = 0.1;

/// A length without a stated error is taken to be measured to a thousandth, as with a tape.
inline constexpr double kUnstatedRelativeSigma = 1e-3;

struct DistanceScale {
  double metres_per_unit = 1;
  double relative_sigma = 0;   ///< standard deviation of metres_per_unit over itself
  std::vector<double> sigmas;  ///< per distance: how far it is off that scale, in its own sigmas
};

/// The weighted mean of the scales that the distances say, their errors independent. Where several
/// disagree by more than their own errors allow, the uncertainty is widened by as much.
/// Throws Error, naming a distance, where points coincide or are so uncertain that the scale would
/// be by more than 10 %, and where one is more than 5 standard deviations off the others.
DistanceScale ScaleFromDistances(std::span<const MeasuredDistance> distances);

/// Geodetic coordinates (WGS 84) as metres in the Earth's frame (EPSG 4978).
Eigen::Vector3d EarthFromGeodetic(double latitude_deg, double longitude_deg, double height_m);
/// Axes east, north, up at that place, as rows: p_in_enu = rotation * (p -
/// EarthFromGeodetic(place)).
Eigen::Matrix3d EnuFromEarth(double latitude_deg, double longitude_deg);

inline constexpr size_t kMinPositions = 4;
inline constexpr double kPositionOutlierSigmas = 4;
/// Standard deviation per axis of a place on the map whose error is said as a radius, as EXIF's
/// GPSHPositioningError is: 68 % of the errors are taken to lie within, and to be normal and equal
/// along both axes (docs/CALIBRATION.md says why).
double SigmaOfRadius(double radius_m);

/// The median length of a 3D vector of independent normal coordinates, in their sigmas.
inline constexpr double kMedianLength = 1.538;

/// Where the turn of a similarity is known worse, which axis is up is not known either.
inline constexpr double kMaxTurnSigmaRad = 5 * std::numbers::pi / 180;

struct PositionScale {
  Similarity metric_from_scene;
  double relative_sigma = 0;     ///< of its scale
  double turn_sigma_rad = 0;     ///< of its rotation, about the axis known worst
  double rms_m = 0;              ///< distances of the positions that were used
  double sigma_m = 0;            ///< of a coordinate of theirs, what the fit takes up counted
  std::vector<size_t> left_out;  ///< positions that do not agree with the others
  bool settled = true;  ///< false: of which positions agree, the last pass had it otherwise
};

/// Fills in how well such a similarity is known where the coordinates of position i err
/// independently by `sigmas_m[i]`, metres > 0; `centres` as metric_from_scene takes them. By least
/// squares: a vague place takes nothing from what exact ones tell. Infinite where nothing is known.
void FillUncertainty(std::span<const Eigen::Vector3d> centres,
                     std::span<const Eigen::Vector3d> sigmas_m, PositionScale& scale);

/// The similarity that carries camera centres to the places where they are said to have been, with
/// `known_scale` (metres per unit) where that is given. Positions more than kPositionOutlierSigmas
/// robust standard deviations off are left out. Errors are taken as independent; those of one
/// receiver go together over minutes, and then the truth is less certain. Throws Error with fewer
/// than 4 positions, where fewer than half agree, and where the centres lie in one point or on a
/// line to rounding. `relative_sigma` is what the positions alone tell of the scale.
PositionScale AlignToPositions(std::span<const Eigen::Vector3d> centres,
                               std::span<const Eigen::Vector3d> positions_m,
                               std::optional<double> known_scale = {});

/// Throws Error where such a scale would be uncertain by more than kMaxRelativeSigma.
void RequireKnownScale(const PositionScale& scale);

/// AlignToPositions, the scale unknown, and RequireKnownScale.
PositionScale ScaleFromPositions(std::span<const Eigen::Vector3d> centres,
                                 std::span<const Eigen::Vector3d> positions_m);

}  // namespace dtr::calib
