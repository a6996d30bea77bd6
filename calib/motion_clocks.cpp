#include "calib/motion_clocks.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"

namespace dtr::calib {
namespace {

constexpr int kPlanes = 48;                 // through both centres, over what both images show
constexpr double kMinSinToBaseline = 0.09;  // 5 degrees: near the epipole a cell is in many planes
constexpr double kMinScore = 0.2;           // correlation; less is no motion in common
constexpr double kLobe = 0.7;               // of the best score: the slopes of its own peak
constexpr double kRival = 0.85;             // of the best score: as good as that, elsewhere
constexpr double kMaxContradiction = 1;     // frames

using Planes = Eigen::Array<double, kPlanes, 1>;

// Directions of a camera's cells in the world; NaN where the lens sees nothing.
std::vector<Eigen::Vector3d> RaysOf(const MotionSeen& camera) {
  const auto some = std::find_if(camera.cells.begin(), camera.cells.end(),
                                 [](const Grid<float>& cells) { return !cells.empty(); });
  std::vector<Eigen::Vector3d> rays;
  if (some == camera.cells.end()) return rays;
  for (int y = 0; y < some->height(); ++y) {
    for (int x = 0; x < some->width(); ++x) {
      const Eigen::Vector2d pixel((x + 0.5) / some->width() * camera.lens.width_px,
                                  (y + 0.5) / some->height() * camera.lens.height_px);
      const auto ray = camera.lens.RayFromPixel(pixel);
      rays.push_back(ray ? camera.cam_from_world.rotation.conjugate() * *ray
                         : Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
    }
  }
  return rays;
}

// Per cell, the angle of its plane around the baseline; NaN where it has none.
std::vector<double> PlaneAngles(const std::vector<Eigen::Vector3d>& rays,
                                const Eigen::Vector3d& along, const Eigen::Vector3d& middle) {
  const Eigen::Vector3d across = along.cross(middle);
  std::vector<double> angles;
  for (const Eigen::Vector3d& ray : rays) {
    const bool far = ray.cross(along).norm() > kMinSinToBaseline;
    angles.push_back(far ? std::atan2(ray.dot(across), ray.dot(middle))
                         : std::numeric_limits<double>::quiet_NaN());
  }
  return angles;
}

std::pair<double, double> RangeOf(const std::vector<double>& angles) {
  std::pair range(std::numeric_limits<double>::infinity(),
                  -std::numeric_limits<double>::infinity());
  for (const double angle : angles) {
    if (std::isnan(angle)) continue;
    range.first = std::min(range.first, angle);
    range.second = std::max(range.second, angle);
  }
  return range;
}

// Motion per plane and frame; empty where it is not known. The root lessens how much a near thing
// outweighs all others.
std::vector<std::optional<Planes>> MotionByPlane(const MotionSeen& camera,
                                                 const std::vector<double>& angles, double low,
                                                 double high) {
  std::vector<int> plane_of;
  for (const double angle : angles) {
    const double at = (angle - low) / (high - low) * kPlanes;
    plane_of.push_back(at >= 0 && at < kPlanes ? static_cast<int>(at) : -1);
  }
  std::vector<std::optional<Planes>> motion(camera.cells.size());
  for (size_t t = 0; t < motion.size(); ++t) {
    if (camera.cells[t].empty()) continue;
    Planes sums = Planes::Zero();
    for (size_t i = 0; i < plane_of.size(); ++i) {
      if (plane_of[i] >= 0) sums[plane_of[i]] += static_cast<double>(camera.cells[t].data()[i]);
    }
    motion[t] = sums.sqrt();
  }
  return motion;
}

// Correlation of a's motion with that of b `shift` frames later; empty where too few are common.
std::optional<double> Correlation(const std::vector<std::optional<Planes>>& a,
                                  const std::vector<std::optional<Planes>>& b, int shift,
                                  int fewest) {
  Planes sum_a = Planes::Zero(), sum_b = Planes::Zero();
  Planes aa = Planes::Zero(), bb = Planes::Zero(), ab = Planes::Zero();
  int frames = 0;
  for (int t = std::max(0, -shift); t < static_cast<int>(a.size()); ++t) {
    if (t + shift >= static_cast<int>(b.size())) break;
    const auto& in_a = a[static_cast<size_t>(t)];
    const auto& in_b = b[static_cast<size_t>(t + shift)];
    if (!in_a || !in_b) continue;
    sum_a += *in_a;
    sum_b += *in_b;
    aa += in_a->square();
    bb += in_b->square();
    ab += *in_a * *in_b;
    ++frames;
  }
  if (frames < fewest) return {};
  const double of_a = (aa - sum_a.square() / frames).sum();
  const double of_b = (bb - sum_b.square() / frames).sum();
  if (!(of_a > 0) || !(of_b > 0)) return 0.0;
  return (ab - sum_a * sum_b / frames).sum() / std::sqrt(of_a * of_b);
}

// How much later b's frames are than a's.
struct PairShift {
  size_t a = 0, b = 0;
  double later = 0, score = 0;
};

// The peak of the scores (shift, score), where it is the only one.
std::optional<PairShift> PeakOf(const std::map<int, double>& scores) {
  const auto peak =
      std::max_element(scores.begin(), scores.end(),
                       [](const auto& x, const auto& y) { return x.second < y.second; });
  if (peak == scores.end() || peak->second < kMinScore) return {};
  const auto before = scores.find(peak->first - 1), after = scores.find(peak->first + 1);
  if (before == scores.end() || after == scores.end()) return {};
  auto first = peak, last = peak;
  while (first != scores.begin() && std::prev(first)->second > kLobe * peak->second) --first;
  while (std::next(last) != scores.end() && std::next(last)->second > kLobe * peak->second) ++last;
  const bool rival = std::any_of(scores.begin(), scores.end(), [&](const auto& other) {
    const bool own = other.first >= first->first && other.first <= last->first;
    return !own && other.second > kRival * peak->second;
  });
  if (rival) return {};
  const double bend = before->second - 2 * peak->second + after->second;
  const double within = bend < 0 ? 0.5 * (before->second - after->second) / bend : 0;
  return PairShift{0, 0, peak->first + within, peak->second};
}

std::optional<PairShift> ShiftOfPair(const MotionSeen& a, const MotionSeen& b,
                                     const std::vector<Eigen::Vector3d>& rays_a,
                                     const std::vector<Eigen::Vector3d>& rays_b) {
  const Eigen::Vector3d baseline =
      b.cam_from_world.TargetOriginInSource() - a.cam_from_world.TargetOriginInSource();
  if (rays_a.empty() || rays_b.empty() || !(baseline.norm() > 0)) return {};
  const Eigen::Vector3d along = baseline.normalized();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto* rays : {&rays_a, &rays_b}) {
    for (const Eigen::Vector3d& ray : *rays) {
      if (ray.allFinite()) middle += ray;
    }
  }
  middle -= middle.dot(along) * along;
  if (!(middle.norm() > 0)) return {};
  middle.normalize();
  const std::vector<double> angles_a = PlaneAngles(rays_a, along, middle);
  const std::vector<double> angles_b = PlaneAngles(rays_b, along, middle);
  const auto of_a = RangeOf(angles_a), of_b = RangeOf(angles_b);
  const double low = std::max(of_a.first, of_b.first), high = std::min(of_a.second, of_b.second);
  if (!(low < high)) return {};
  const auto motion_a = MotionByPlane(a, angles_a, low, high);
  const auto motion_b = MotionByPlane(b, angles_b, low, high);
  const int frames = static_cast<int>(std::max(motion_a.size(), motion_b.size()));
  const auto known = [](const auto& motion) {
    return static_cast<int>(std::count_if(motion.begin(), motion.end(),
                                          [](const auto& planes) { return planes.has_value(); }));
  };
  const int fewest = std::max(kFewestFrames, std::min(known(motion_a), known(motion_b)) / 2);
  std::map<int, double> scores;
  for (int shift = -frames; shift <= frames; ++shift) {
    if (const auto score = Correlation(motion_a, motion_b, shift, fewest)) scores[shift] = *score;
  }
  return PeakOf(scores);
}

std::vector<PairShift> ShiftsOfPairs(const std::vector<MotionSeen>& cameras) {
  std::vector<std::vector<Eigen::Vector3d>> rays;
  for (const MotionSeen& camera : cameras) rays.push_back(RaysOf(camera));
  std::vector<std::pair<size_t, size_t>> pairs;
  for (size_t a = 0; a < cameras.size(); ++a) {
    for (size_t b = a + 1; b < cameras.size(); ++b) pairs.emplace_back(a, b);
  }
  std::vector<std::optional<PairShift>> found(pairs.size());
  ParallelFor(0, static_cast<int>(pairs.size()), [&](int i) {
    const auto [a, b] = pairs[static_cast<size_t>(i)];
    auto& shift = found[static_cast<size_t>(i)];
    shift = ShiftOfPair(cameras[a], cameras[b], rays[a], rays[b]);
    if (shift) std::tie(shift->a, shift->b) = std::pair(a, b);
  });
  std::vector<PairShift> shifts;
  for (const auto& shift : found) {
    if (shift) shifts.push_back(*shift);
  }
  // Best first; ties in the cameras' order.
  std::stable_sort(shifts.begin(), shifts.end(),
                   [](const PairShift& x, const PairShift& y) { return x.score > y.score; });
  return shifts;
}

// Shifts of all cameras by the best pairs that join them to the first; empty for one that none
// joins.
std::vector<std::optional<double>> ByBestPairs(const std::vector<PairShift>& shifts, size_t cameras,
                                               size_t first) {
  std::vector<std::optional<double>> later(cameras);
  later[first] = 0.0;
  for (bool more = true; more;) {
    more = false;
    for (const PairShift& pair : shifts) {
      if (later[pair.a].has_value() == later[pair.b].has_value()) continue;
      if (later[pair.a]) {
        later[pair.b] = *later[pair.a] + pair.later;
      } else {
        later[pair.a] = *later[pair.b] - pair.later;
      }
      more = true;
      break;  // the best pair again
    }
  }
  return later;
}

void RequireAllJoined(const std::vector<PairShift>& shifts,
                      const std::vector<std::optional<double>>& later,
                      const std::vector<MotionSeen>& cameras) {
  const auto joined = [](const auto& list) {
    return std::count_if(list.begin(), list.end(), [](const auto& at) { return at.has_value(); });
  };
  for (size_t c = 0; c < later.size(); ++c) {
    if (later[c]) continue;
    // Where more are joined to this one than to the first, that is the odd one.
    if (joined(ByBestPairs(shifts, later.size(), c)) > joined(later)) c = 0;
    throw Error(fmt::format(
        "clocks: camera {}: expected motion that it and another camera see, and that does not "
        "repeat, found none; record something that moves in the middle of the scene, keep clocks "
        "apart by less than half the recording, or state the frames in timestamps.csv",
        cameras[c].name));
  }
}

// Least squares over the pairs that agree with `later`, weighted by their scores.
std::vector<double> Joined(const std::vector<PairShift>& agreeing, size_t cameras) {
  const auto unknowns = static_cast<long>(cameras) - 1;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
  for (const PairShift& pair : agreeing) {
    const double weight = pair.score * pair.score;
    Eigen::VectorXd row = Eigen::VectorXd::Zero(unknowns);
    if (pair.a > 0) row[static_cast<long>(pair.a) - 1] = -1;
    row[static_cast<long>(pair.b) - 1] = 1;
    normal += weight * row * row.transpose();
    right += weight * pair.later * row;
  }
  const Eigen::VectorXd solved = normal.ldlt().solve(right);
  std::vector<double> later{0};
  later.insert(later.end(), solved.begin(), solved.end());
  return later;
}

void RequireMotion(const std::vector<MotionSeen>& cameras) {
  if (cameras.size() < 2) throw std::invalid_argument("FindMotionClocks: fewer than two cameras");
  for (const MotionSeen& camera : cameras) {
    const Grid<float>* first = nullptr;
    for (const Grid<float>& cells : camera.cells) {
      if (cells.empty()) continue;
      if (first == nullptr) first = &cells;
      if (cells.width() != first->width() || cells.height() != first->height()) {
        throw std::invalid_argument("FindMotionClocks: cells of different sizes");
      }
    }
  }
}

}  // namespace

std::vector<MotionClock> FindMotionClocks(const std::vector<MotionSeen>& cameras) {
  RequireMotion(cameras);
  const std::vector<PairShift> shifts = ShiftsOfPairs(cameras);
  const auto by_best = ByBestPairs(shifts, cameras.size(), 0);
  RequireAllJoined(shifts, by_best, cameras);
  std::vector<PairShift> agreeing;
  std::vector<int> contradicting(cameras.size());
  for (const PairShift& pair : shifts) {
    const double off = pair.later - (*by_best[pair.b] - *by_best[pair.a]);
    if (std::abs(off) <= kMaxContradiction) {
      agreeing.push_back(pair);
    } else {
      ++contradicting[pair.a];
      ++contradicting[pair.b];
    }
  }
  const std::vector<double> later = Joined(agreeing, cameras.size());
  std::vector<MotionClock> clocks(cameras.size());
  for (const PairShift& pair : agreeing) {
    const double off = pair.later - (later[pair.b] - later[pair.a]);
    for (const size_t c : {pair.a, pair.b}) {
      clocks[c].rms_frames += off * off;
      ++clocks[c].pairs;
    }
  }
  for (size_t c = 0; c < clocks.size(); ++c) {
    clocks[c].later = later[c];
    clocks[c].rms_frames = std::sqrt(clocks[c].rms_frames / clocks[c].pairs);
    if (contradicting[c] <= clocks[c].pairs) continue;
    throw Error(fmt::format(
        "clocks: camera {}: of {} other cameras {} contradict what the others say of its clock; "
        "state the frames in timestamps.csv, or leave the camera out",
        cameras[c].name, clocks[c].pairs + contradicting[c], contradicting[c]));
  }
  return clocks;
}

}  // namespace dtr::calib
