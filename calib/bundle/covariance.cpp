#include "calib/bundle/covariance.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/bundle/gauge.h"
#include "calib/bundle/lens_params.h"
#include "calib/bundle/normalised.h"
#include "calib/bundle/observation_rows.h"
#include "calib/bundle/unit_inverse.h"

namespace dtr::calib {
namespace {

// A direction of the gauge is settled when the priors' information about it is more than this share
// of the observations' typical information.
constexpr double kSettled = 1e-12;

// Sums over points, of what their observations say with the point eliminated: J^T J, and g g^T with
// g = J^T r of a point as a whole.
struct Sums {
  Eigen::MatrixXd information, scatter;
  int points = 0;  // that say something
  long rows = 0;   // of J
};

// The unknowns that the observations of one point depend on, and their rows.
struct TrackRows {
  std::vector<int> columns;  // unknowns
  std::vector<ObservationRows> rows;
  std::vector<std::pair<int, int>> lens_image;  // of each of `rows`

  long ColumnOf(int unknown) {
    const auto found = std::find(columns.begin(), columns.end(), unknown);
    if (found != columns.end()) return static_cast<long>(found - columns.begin());
    columns.push_back(unknown);
    return static_cast<long>(columns.size()) - 1;
  }
};

TrackRows RowsOfTrack(const Normalised& n, const Bundle& bundle, const BundleCovariance& layout,
                      const std::vector<const BundleObservation*>& observations) {
  TrackRows track;
  for (const BundleObservation* observation : observations) {
    ObservationRows made;
    if (!RowsOf(n, bundle, *observation, made)) continue;
    const int lens = bundle.images[static_cast<size_t>(observation->image)].lens;
    for (size_t k = 0; k < layout.free_params[static_cast<size_t>(lens)].size(); ++k) {
      track.ColumnOf(layout.lens_at[static_cast<size_t>(lens)] + static_cast<int>(k));
    }
    for (int k = 0; k < 6; ++k) {
      track.ColumnOf(layout.image_at[static_cast<size_t>(observation->image)] + k);
    }
    track.rows.push_back(std::move(made));
    track.lens_image.emplace_back(lens, observation->image);
  }
  return track;
}

void AddPoint(const Normalised& n, const Bundle& bundle, const BundleCovariance& layout,
              const std::vector<const BundleObservation*>& observations, Sums& sums) {
  TrackRows track = RowsOfTrack(n, bundle, layout, observations);
  const auto height = 2 * static_cast<long>(track.rows.size());
  if (height < 4) return;  // one observation says nothing about anything but its point
  const auto unknowns = static_cast<long>(track.columns.size());
  Eigen::MatrixXd by_point(height, 3);
  Eigen::MatrixXd rest = Eigen::MatrixXd::Zero(height, unknowns + 1);  // the last: residuals
  for (size_t i = 0; i < track.rows.size(); ++i) {
    const auto at = 2 * static_cast<long>(i);
    const ObservationRows& rows = track.rows[i];
    by_point.middleRows<2>(at) = rows.point;
    rest.block<2, 1>(at, unknowns) = rows.residual;
    const auto [lens, image] = track.lens_image[i];
    const auto& free = layout.free_params[static_cast<size_t>(lens)];
    for (size_t k = 0; k < free.size(); ++k) {
      const int unknown = layout.lens_at[static_cast<size_t>(lens)] + static_cast<int>(k);
      rest.block<2, 1>(at, track.ColumnOf(unknown)) = rows.lens.col(free[k]);
    }
    for (int k = 0; k < 6; ++k) {
      const int unknown = layout.image_at[static_cast<size_t>(image)] + k;
      rest.block<2, 1>(at, track.ColumnOf(unknown)) = rows.pose.col(k);
    }
  }
  const Eigen::MatrixXd left = WithoutPoint(by_point, rest);
  const Eigen::MatrixXd product = left.leftCols(unknowns).transpose() * left;
  for (long i = 0; i < unknowns; ++i) {
    const int row = track.columns[static_cast<size_t>(i)];
    for (long j = 0; j < unknowns; ++j) {
      const int column = track.columns[static_cast<size_t>(j)];
      sums.information(row, column) += product(i, j);
      sums.scatter(row, column) += product(i, unknowns) * product(j, unknowns);
    }
  }
  ++sums.points;
  sums.rows += left.rows();
}

// Covariance of the gradient at the solution. Errors of one point's observations are not
// independent, and not equally large: a feature of a far side drifts along its whole track. So a
// point counts as a whole (Liang and Zeger 1986, "Longitudinal data analysis using generalized
// linear models", eq. 5), widened for what the solve has fitted. Of few points that says little:
// by as much as there are unknowns per point it is pulled to sigma^2 J^T J, of independent errors.
// Nothing is known better than to kPrecisionPx.
Eigen::MatrixXd OfGradient(const Sums& sums, double sigma_px) {
  const auto unknowns = static_cast<double>(sums.information.rows());
  const auto rows = static_cast<double>(sums.rows);
  const double independent = std::min(1.0, unknowns / std::max(1, sums.points));
  if (independent >= 1 || rows <= unknowns) return sigma_px * sigma_px * sums.information;
  const double variance = independent * sigma_px * sigma_px + kPrecisionPx * kPrecisionPx;
  return variance * sums.information + (1 - independent) * rows / (rows - unknowns) * sums.scatter;
}

void AddLensInformation(const Normalised& n, const Bundle& bundle, const BundleCovariance& layout,
                        const AdjustOptions& options, Eigen::MatrixXd& information) {
  for (size_t i = 0; i < bundle.lenses.size(); ++i) {
    const LensFrame& lens = n.lenses[i];
    const auto& free = layout.free_params[i];
    const auto unknown = [&](int param) {
      return layout.lens_at[i] + (std::find(free.begin(), free.end(), param) - free.begin());
    };
    const double known_px = PrincipalPointSigmaPx(bundle.lenses[i], options);
    const int centre = FocalCount(lens.model);
    for (const int param : {centre, centre + 1}) {
      if (!std::isfinite(known_px)) break;
      const double unit = lens.scale[static_cast<size_t>(param)];
      information(unknown(param), unknown(param)) += std::pow(layout.sigma_px * unit / known_px, 2);
    }
    const double known = AspectSigma(bundle.lenses[i], options);
    if (!std::isfinite(known)) continue;
    Eigen::VectorXd row = Eigen::VectorXd::Zero(information.rows());
    row[unknown(0)] = -layout.sigma_px / known * lens.scale[0] / lens.centre[0];
    row[unknown(1)] = layout.sigma_px / known * lens.scale[1] / lens.centre[1];
    information += row * row.transpose();
  }
}

Eigen::MatrixXd PriorInformation(const Normalised& n, const Bundle& bundle,
                                 const BundleCovariance& layout, const AdjustOptions& options,
                                 long unknowns) {
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(unknowns, unknowns);
  const double unit_px =
      layout.sigma_px * n.unit;  // observations' units: everything is scaled by sigma
  for (const PositionPrior& p : options.positions) {
    const long at = layout.image_at[static_cast<size_t>(p.image)] + 3;
    for (int k = 0; k < 3; ++k) {
      information(at + k, at + k) += std::pow(unit_px / p.sigma[k], 2);
    }
  }
  for (const DistancePrior& d : options.distances) {
    const auto a = static_cast<size_t>(d.image_a), b = static_cast<size_t>(d.image_b);
    const Eigen::Vector3d along = (n.poses[a].centre - n.poses[b].centre).normalized();
    Eigen::VectorXd row = Eigen::VectorXd::Zero(unknowns);
    row.segment<3>(layout.image_at[a] + 3) = unit_px / d.sigma * along;
    row.segment<3>(layout.image_at[b] + 3) = -unit_px / d.sigma * along;
    information += row * row.transpose();
  }
  AddLensInformation(n, bundle, layout, options, information);
  return information;
}

// The directions of the gauge that no prior settles.
Eigen::MatrixXd OpenDirections(const Eigen::MatrixXd& gauge, const Eigen::MatrixXd& priors,
                               double typical) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(gauge.transpose() * priors * gauge);
  long open = 0;
  while (open < gauge.cols() && eigen.eigenvalues()[open] <= kSettled * typical) ++open;
  return gauge * eigen.eigenvectors().leftCols(open);
}

std::string NameOfUnknown(const Bundle& bundle, const BundleCovariance& layout, long unknown) {
  for (size_t i = 0; i < layout.free_params.size(); ++i) {
    const long k = unknown - layout.lens_at[i];
    if (k < 0 || k >= static_cast<long>(layout.free_params[i].size())) continue;
    const auto names = ParameterNames(bundle.lenses[i].model);
    return fmt::format("{} of camera {}",
                       names[static_cast<size_t>(layout.free_params[i][static_cast<size_t>(k)])],
                       i + 1);
  }
  for (size_t i = 0; i < layout.image_at.size(); ++i) {
    const long k = unknown - layout.image_at[i];
    if (k < 0 || k >= 6) continue;
    return fmt::format("{} of {}", k < 3 ? "rotation" : "position", bundle.images[i].name);
  }
  return "";
}

// Inverts the information with the gauge's directions left out: H^-1 G H^-1, G the covariance of
// the gradient.
void Invert(const Bundle& bundle, const Eigen::MatrixXd& information, const Eigen::MatrixXd& open,
            const Eigen::MatrixXd& of_gradient, BundleCovariance& out) {
  const long unknowns = information.rows();
  const double typical = information.trace() / static_cast<double>(unknowns);
  const Eigen::MatrixXd closed = information + typical * open * open.transpose();
  const Eigen::VectorXd diagonal = closed.diagonal();
  if (!closed.allFinite() || !(diagonal.array() > 0).all()) {
    long index = 0;
    diagonal.minCoeff(&index);
    out.determined = false;
    out.weakest = NameOfUnknown(bundle, out, index);
    out.condition = std::numeric_limits<double>::infinity();
    return;
  }
  const Eigen::VectorXd scale = diagonal.cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * closed * scale.asDiagonal();
  const UnitInverse inverse = InverseOfUnitDiagonal(scaled);
  long index = 0;
  inverse.weakest.cwiseAbs().maxCoeff(&index);
  out.weakest = NameOfUnknown(bundle, out, index);
  out.condition = inverse.least > 0 ? std::sqrt(inverse.most / inverse.least)
                                    : std::numeric_limits<double>::infinity();
  out.determined = inverse.matrix.size() > 0;
  if (!out.determined) return;
  Eigen::MatrixXd inverted = scale.asDiagonal() * inverse.matrix * scale.asDiagonal();
  inverted -= open * open.transpose() / typical;
  out.matrix = inverted * of_gradient * inverted;
}

// From the solver's units to parameters, radians and world units.
void ToUnits(const Normalised& n, BundleCovariance& out) {
  Eigen::VectorXd units = Eigen::VectorXd::Ones(out.matrix.rows());
  for (size_t i = 0; i < out.lens_at.size(); ++i) {
    for (size_t k = 0; k < out.free_params[i].size(); ++k) {
      units[out.lens_at[i] + static_cast<long>(k)] =
          n.lenses[i].scale[static_cast<size_t>(out.free_params[i][k])];
    }
  }
  for (const int at : out.image_at) units.segment<3>(at + 3).setConstant(n.unit);
  out.matrix = units.asDiagonal() * out.matrix * units.asDiagonal();
}

}  // namespace

Eigen::MatrixXd BundleCovariance::OfImage(int image) const {
  const long at = image_at[static_cast<size_t>(image)];
  return matrix.block<6, 6>(at, at);
}

Eigen::MatrixXd BundleCovariance::OfLens(const Bundle& bundle, int lens) const {
  const auto& free = free_params[static_cast<size_t>(lens)];
  const long size = static_cast<long>(bundle.lenses[static_cast<size_t>(lens)].params.size());
  Eigen::MatrixXd of_lens = Eigen::MatrixXd::Zero(size, size);
  const long at = lens_at[static_cast<size_t>(lens)];
  for (size_t i = 0; i < free.size(); ++i) {
    for (size_t j = 0; j < free.size(); ++j) {
      of_lens(free[i], free[j]) = matrix(at + static_cast<long>(i), at + static_cast<long>(j));
    }
  }
  return of_lens;
}

BundleCovariance CovarianceOf(const Adjusted& adjusted, const AdjustOptions& options) {
  const Bundle& bundle = adjusted.bundle;
  BundleCovariance out;
  out.sigma_px = std::max(adjusted.sigma_px, kPrecisionPx);
  int unknowns = 0;
  for (const LensCamera& lens : bundle.lenses) {
    out.free_params.push_back(FreeParams(lens, options.lens));
    out.lens_at.push_back(unknowns);
    unknowns += static_cast<int>(out.free_params.back().size());
  }
  for (size_t i = 0; i < bundle.images.size(); ++i) {
    out.image_at.push_back(unknowns);
    unknowns += 6;
  }
  if (unknowns > kMaxUnknowns) return out;
  out.computed = true;
  const Normalised n = Normalised::Around(bundle);
  Sums sums;
  sums.information = sums.scatter = Eigen::MatrixXd::Zero(unknowns, unknowns);
  std::vector<std::vector<const BundleObservation*>> tracks(bundle.points.size());
  for (size_t i = 0; i < bundle.observations.size(); ++i) {
    if (!adjusted.used[i]) continue;
    tracks[static_cast<size_t>(bundle.observations[i].point)].push_back(&bundle.observations[i]);
  }
  for (const auto& observations : tracks) AddPoint(n, bundle, out, observations, sums);
  const Eigen::MatrixXd priors = PriorInformation(n, bundle, out, options, unknowns);
  const Eigen::MatrixXd open = OpenDirections(GaugeDirections(n.poses, out.image_at, unknowns),
                                              priors, sums.information.trace() / unknowns);
  out.gauge_freedom = static_cast<int>(open.cols());
  Invert(bundle, sums.information + priors, open,
         OfGradient(sums, out.sigma_px) + out.sigma_px * out.sigma_px * priors, out);
  if (out.determined) ToUnits(n, out);
  return out;
}

Eigen::Matrix2d TransferCovariance(const Bundle& bundle, const BundleCovariance& covariance,
                                   const Eigen::Vector3d& p_in_world, int a, int b, int seen_in) {
  const Eigen::Matrix2d none = Eigen::Matrix2d::Constant(std::numeric_limits<double>::quiet_NaN());
  Bundle one;
  one.lenses = bundle.lenses;
  one.points = {p_in_world.homogeneous()};
  const int images[] = {a, b, seen_in};
  for (int i = 0; i < 3; ++i) {
    one.images.push_back(bundle.images[static_cast<size_t>(images[i])]);
    one.observations.push_back({i, 0, Eigen::Vector2d::Zero()});
  }
  const Normalised n = Normalised::Around(one);
  ObservationRows rows[3];
  for (size_t i = 0; i < 3; ++i) {
    if (!RowsOf(n, one, one.observations[i], rows[i])) return none;
  }
  Eigen::Matrix<double, 4, 3> by_point;
  by_point << rows[0].point, rows[1].point;
  const Eigen::ColPivHouseholderQR<Eigen::Matrix<double, 4, 3>> qr(by_point);
  if (qr.rank() < 3) return none;
  // The point moves with a and b by -(A^T A)^-1 A^T B, so that its pixels in them stay.
  const Eigen::Matrix<double, 2, 4> follows = rows[2].point * qr.solve(Eigen::Matrix4d::Identity());
  Eigen::MatrixXd by_all = Eigen::MatrixXd::Zero(2, covariance.matrix.rows());
  for (size_t i = 0; i < 3; ++i) {
    const auto lens = static_cast<size_t>(one.images[i].lens);
    const Eigen::Matrix2d lever =
        i < 2 ? Eigen::Matrix2d(-follows.block<2, 2>(0, 2 * static_cast<long>(i)))
              : Eigen::Matrix2d::Identity();
    const auto& free = covariance.free_params[lens];
    for (size_t k = 0; k < free.size(); ++k) {
      by_all.col(covariance.lens_at[lens] + static_cast<long>(k)) +=
          lever * rows[i].lens.col(free[k]) / n.lenses[lens].scale[static_cast<size_t>(free[k])];
    }
    const long at = covariance.image_at[static_cast<size_t>(images[i])];
    by_all.middleCols<3>(at) += lever * rows[i].pose.leftCols<3>();
    by_all.middleCols<3>(at + 3) += lever * rows[i].pose.rightCols<3>() / n.unit;
  }
  return by_all * covariance.matrix * by_all.transpose();
}

}  // namespace dtr::calib
