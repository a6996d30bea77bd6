#include "calib/bundle/plain/problem.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "dtr/base/parallel_for.h"

namespace dtr::calib::plain {
namespace {

constexpr double kNoCost = std::numeric_limits<double>::infinity();

Eigen::Matrix3d TurnOf(const double* w) {
  const Eigen::Vector3d turn(w[0], w[1], w[2]);
  const double angle = turn.norm();
  if (!(angle > 0)) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
}

}  // namespace

double Loss::Of(double squared) const {
  return scale2 > 0 ? scale2 * std::log1p(squared / scale2) : squared;
}

double Loss::Bend(double squared) const {
  constexpr double kMinBend = 0.1;
  if (!(scale2 > 0)) return 1;
  return std::max((scale2 - squared) / (scale2 + squared), kMinBend);
}

Problem::Problem(const Bundle& bundle, const Normalised& n, const std::vector<bool>& used,
                 const Settings& settings)
    : n_(n), settings_(settings), loss_{settings.cauchy_px * settings.cauchy_px} {
  first_.assign(n.points.size() + 1, 0);
  for (size_t i = 0; i < bundle.observations.size(); ++i) {
    if (used[i]) ++first_[static_cast<size_t>(bundle.observations[i].point) + 1];
  }
  for (size_t p = 0; p < n.points.size(); ++p) first_[p + 1] += first_[p];
  seen_.resize(first_.back());
  std::vector<size_t> next(first_.begin(), first_.end() - 1);
  for (size_t i = 0; i < bundle.observations.size(); ++i) {
    if (!used[i]) continue;
    const BundleObservation& o = bundle.observations[i];
    const Eigen::Vector2d pixel = o.pixel - bundle.images[static_cast<size_t>(o.image)].shift_px;
    seen_[next[static_cast<size_t>(o.point)]++] = {o.image, pixel};
  }
  for (size_t p = 0; p < n.points.size(); ++p) {
    std::stable_sort(seen_.begin() + static_cast<long>(first_[p]),
                     seen_.begin() + static_cast<long>(first_[p + 1]),
                     [](const Seen& a, const Seen& b) { return a.image < b.image; });
  }
  for (size_t i = 0; i < bundle.images.size(); ++i) {
    lens_of_image_.push_back(static_cast<size_t>(bundle.images[i].lens));
    shift_scale_.push_back(n.ShiftScalePx(bundle, i));
    shift_at_start_.push_back(bundle.images[i].shift_px);
  }
  for (const LensCamera& lens : bundle.lenses) {
    largest_px_ = std::max<double>(largest_px_, std::max(lens.width_px, lens.height_px));
  }
}

std::vector<Camera> Problem::CamerasAt(const Unknowns& x) const {
  std::vector<Camera> cameras(images());
  for (size_t i = 0; i < cameras.size(); ++i) {
    Camera& camera = cameras[i];
    camera.rotation = TurnOf(x.motion[i].data()) * n_.poses[i].rotation;
    camera.centre = n_.poses[i].centre + Eigen::Map<const Eigen::Vector3d>(x.motion[i].data() + 3);
    camera.lens = lens_of_image_[i];
    if (!x.shift.empty()) {
      camera.shift_px = shift_scale_[i] * Eigen::Map<const Eigen::Vector2d>(x.shift[i].data());
    }
  }
  return cameras;
}

std::vector<Intrinsics> Problem::IntrinsicsAt(const Unknowns& x) const {
  std::vector<Intrinsics> lenses;
  for (size_t i = 0; i < n_.lenses.size(); ++i) {
    const std::vector<double> params = ParamsAt(n_.lenses[i], x.theta[i].data());
    lenses.push_back(IntrinsicsOf(n_.lenses[i].model, params.data()));
  }
  return lenses;
}

double Problem::PointCost(size_t point, const std::array<double, 3>& place,
                          const std::vector<Camera>& cameras,
                          const std::vector<Intrinsics>& lenses) const {
  const PointFrame& frame = n_.points[point];
  const PointAt at(frame, place);
  double sum = 0;
  for (size_t i = first_[point]; i < first_[point + 1]; ++i) {
    const Camera& camera = cameras[static_cast<size_t>(seen_[i].image)];
    const Eigen::Vector3d ray = at.direction + at.rho * (frame.anchor - camera.centre);
    const Eigen::Vector3d p = camera.rotation * ray;
    double pixel[2];
    if (!Project(lenses[camera.lens], p.data(), pixel)) return kNoCost;
    const double dx = pixel[0] + camera.shift_px[0] - seen_[i].pixel[0];
    const double dy = pixel[1] + camera.shift_px[1] - seen_[i].pixel[1];
    sum += loss_.Of(dx * dx + dy * dy);
  }
  return std::isfinite(sum) ? 0.5 * sum : kNoCost;
}

double Problem::PriorAt(const LensPrior& prior, const Unknowns& x,
                        double by_theta[kMaxParams]) const {
  const LensFrame& lens = n_.lenses[prior.lens];
  const auto value = [&](size_t k) {
    return lens.centre[k] + lens.scale[k] * x.theta[prior.lens][k];
  };
  std::fill(by_theta, by_theta + kMaxParams, 0.0);
  if (!prior.aspect) {
    const auto k = static_cast<size_t>(prior.param);
    by_theta[k] = prior.weight * lens.scale[k];
    return prior.weight * (value(k) - prior.known);
  }
  const double fx = value(0), fy = value(1);
  if (!(fx > 0) || !(fy > 0)) return kNoCost;
  by_theta[0] = -prior.weight * lens.scale[0] / fx;
  by_theta[1] = prior.weight * lens.scale[1] / fy;
  return prior.weight * (std::log(fy / fx) - prior.known);
}

double Problem::CostAt(const Unknowns& x) const {
  const std::vector<Camera> cameras = CamerasAt(x);
  const std::vector<Intrinsics> lenses = IntrinsicsAt(x);
  const size_t chunks = (points() + kChunkPoints - 1) / kChunkPoints;
  std::vector<double> sums(chunks, 0);
  ParallelFor(0, static_cast<int>(chunks), [&](int chunk) {
    const size_t begin = static_cast<size_t>(chunk) * kChunkPoints;
    const size_t end = std::min(begin + kChunkPoints, points());
    double sum = 0;
    for (size_t p = begin; p < end; ++p) sum += PointCost(p, x.place[p], cameras, lenses);
    sums[static_cast<size_t>(chunk)] = sum;
  });
  double cost = 0;
  for (const double sum : sums) cost += sum;
  double by_theta[kMaxParams];
  for (const LensPrior& prior : settings_.lens_priors) {
    const double residual = PriorAt(prior, x, by_theta);
    cost += 0.5 * residual * residual;
  }
  for (size_t i = 0; i < x.shift.size(); ++i) {
    const Eigen::Vector2d shift = shift_at_start_[i] + cameras[i].shift_px;
    cost += 0.5 * settings_.shift_weights[i] * settings_.shift_weights[i] * shift.squaredNorm();
  }
  return std::isfinite(cost) ? cost : kNoCost;
}

}  // namespace dtr::calib::plain
