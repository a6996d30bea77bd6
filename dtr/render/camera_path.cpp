#include "dtr/render/camera_path.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"

namespace dtr {
namespace {

constexpr size_t kFewKeys = 8;        // more make a path follow the photographer's steps
constexpr size_t kMaxChained = 2048;  // chaining takes time by the square of their number
constexpr int kStepsPerSegment = 64;  // of the table that evens out the speed

struct Key {
  const View* view;  ///< null: of no view
  Eigen::Vector3d center;
  Eigen::Quaterniond world_from_cam;
  double scene_z = 0;  ///< depth of what the camera sees; 0: unknown
};

std::vector<Key> SourceKeys(const DtrSet& set) {
  if (set.frames.empty()) throw Error("set: expected at least one frame, found none");
  std::vector<Key> keys;
  for (const View& view : set.frames.front().views) {
    if (view.role != ViewRole::kSource) continue;
    keys.push_back({&view, view.CenterInWorld(), view.cam_from_world.rotation.conjugate()});
  }
  if (keys.empty()) throw Error("fly-through: expected source views, found none");
  std::sort(keys.begin(), keys.end(),
            [](const Key& a, const Key& b) { return a.view->id < b.view->id; });
  return keys;
}

/// Greedy chain of nearest neighbours from the camera farthest from the mean: an end of an arc.
std::vector<Key> Chain(std::vector<Key> keys) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Key& key : keys) mean += key.center / static_cast<double>(keys.size());
  const auto nearer_mean = [&](const Key& a, const Key& b) {
    return (a.center - mean).norm() < (b.center - mean).norm();
  };
  auto next = std::max_element(keys.begin(), keys.end(), nearer_mean);
  std::vector<Key> chain;
  while (true) {
    chain.push_back(*next);
    keys.erase(next);
    if (keys.empty()) return chain;
    const Eigen::Vector3d here = chain.back().center;
    next = std::min_element(keys.begin(), keys.end(), [&](const Key& a, const Key& b) {
      return (a.center - here).norm() < (b.center - here).norm();
    });
  }
}

/// At most `max` of the keys at even steps, the first and the last among them.
std::vector<Key> Thinned(std::vector<Key> keys, size_t max) {
  if (keys.size() <= max) return keys;
  std::vector<Key> thinned;
  for (size_t i = 0; i < max; ++i) thinned.push_back(keys[i * (keys.size() - 1) / (max - 1)]);
  return thinned;
}

/// The longest piece of the chain whose steps are through free space.
std::vector<Key> LongestFreePiece(const std::vector<Key>& chain, const FreeSpace& space) {
  size_t begin = 0, best_begin = 0, best_size = 0;
  for (size_t i = 0; i < chain.size(); ++i) {
    if (i > 0 && !space.HasLine(chain[i - 1].center, chain[i].center)) begin = i;
    if (i + 1 - begin > best_size) best_begin = begin, best_size = i + 1 - begin;
  }
  const auto first = chain.begin() + static_cast<std::ptrdiff_t>(best_begin);
  return {first, first + static_cast<std::ptrdiff_t>(best_size)};
}

/// Median distance between neighbours of the chain; infinite for a single camera.
double UsualStep(const std::vector<Key>& chain) {
  std::vector<double> steps;
  for (size_t i = 1; i < chain.size(); ++i) {
    steps.push_back((chain[i].center - chain[i - 1].center).norm());
  }
  return steps.empty() ? std::numeric_limits<double>::infinity() : UpperMedian(steps);
}

/// Neighbouring quaternions in one half space: q and -q are the same rotation.
void AlignSigns(std::vector<Key>& keys) {
  for (size_t i = 1; i < keys.size(); ++i) {
    if (keys[i].world_from_cam.dot(keys[i - 1].world_from_cam) < 0) {
      keys[i].world_from_cam.coeffs() *= -1;
    }
  }
}

Eigen::Vector3d Log(const Eigen::Quaterniond& q) {
  const double length = q.vec().norm();
  if (length == 0) return Eigen::Vector3d::Zero();
  return q.vec() * (std::atan2(length, q.w()) / length);
}

Eigen::Quaterniond Exp(const Eigen::Vector3d& half_angle) {
  const double length = half_angle.norm();
  if (length == 0) return Eigen::Quaterniond::Identity();
  Eigen::Quaterniond q;
  q.w() = std::cos(length);
  q.vec() = half_angle * (std::sin(length) / length);
  return q;
}

class Spline {
 public:
  explicit Spline(std::vector<Key> keys) : keys_(std::move(keys)) {
    AlignSigns(keys_);
    knots_ = {0};
    for (size_t i = 1; i < keys_.size(); ++i) {
      // Centripetal: the square root of the chord; cameras at one place still differ in time.
      const double chord = (keys_[i].center - keys_[i - 1].center).norm();
      knots_.push_back(knots_.back() + std::sqrt(chord));
    }
    if (!(knots_.back() > 0)) {
      for (size_t i = 0; i < knots_.size(); ++i) knots_[i] = static_cast<double>(i);
    }
  }

  size_t segments() const { return keys_.size() - 1; }

  /// Segment and share of it, both from s in [0, segments].
  Eigen::Vector3d Position(double s) const {
    const auto [i, u] = Locate(s);
    const double width = knots_[i + 1] - knots_[i];
    const double u2 = u * u, u3 = u2 * u;
    return (2 * u3 - 3 * u2 + 1) * keys_[i].center + (u3 - 2 * u2 + u) * width * Tangent(i) +
           (3 * u2 - 2 * u3) * keys_[i + 1].center + (u3 - u2) * width * Tangent(i + 1);
  }

  /// Image motion between two parameters: translation as a share of the scene's depth, and
  /// rotation; the distance alone where depth is unknown.
  double Motion(double from, double to) const {
    const double distance = (Position(to) - Position(from)).norm();
    const auto [i, u] = Locate(to);
    const double z = keys_[i].scene_z, next_z = keys_[i + 1].scene_z;
    if (!(z > 0 && next_z > 0)) return distance;
    return distance / (z * std::pow(next_z / z, u)) + Rotation(to).angularDistance(Rotation(from));
  }

  Eigen::Quaterniond Rotation(double s) const {
    const auto [i, u] = Locate(s);
    const Eigen::Quaterniond along = keys_[i].world_from_cam.slerp(u, keys_[i + 1].world_from_cam);
    const Eigen::Quaterniond inner = Control(i).slerp(u, Control(i + 1));
    return along.slerp(2 * u * (1 - u), inner).normalized();
  }

 private:
  std::pair<size_t, double> Locate(double s) const {
    const double last = static_cast<double>(segments() - 1);
    const double i = std::clamp(std::floor(s), 0.0, last);
    return {static_cast<size_t>(i), std::clamp(s - i, 0.0, 1.0)};
  }

  /// Velocity at key i per unit of the knots: of the parabola through it and its neighbours.
  Eigen::Vector3d Tangent(size_t i) const {
    if (i == 0) return Chord(0);
    if (i == segments()) return Chord(i - 1);
    const double before = knots_[i] - knots_[i - 1], after = knots_[i + 1] - knots_[i];
    if (!(before + after > 0)) return Eigen::Vector3d::Zero();
    return (Chord(i - 1) * after + Chord(i) * before) / (before + after);
  }

  Eigen::Vector3d Chord(size_t i) const {
    const double width = knots_[i + 1] - knots_[i];
    if (!(width > 0)) return Eigen::Vector3d::Zero();
    return (keys_[i + 1].center - keys_[i].center) / width;
  }

  /// Shoemake's inner control rotation at key i.
  Eigen::Quaterniond Control(size_t i) const {
    const Eigen::Quaterniond& q = keys_[i].world_from_cam;
    if (i == 0 || i == segments()) return q;
    const Eigen::Vector3d to_next = Log(q.conjugate() * keys_[i + 1].world_from_cam);
    const Eigen::Vector3d to_last = Log(q.conjugate() * keys_[i - 1].world_from_cam);
    return (q * Exp(-0.25 * (to_next + to_last))).normalized();
  }

  std::vector<Key> keys_;
  std::vector<double> knots_;
};

/// Spline parameters at even steps of image motion: translation as a share of the scene's depth,
/// and rotation; even in the parameter where nothing moves.
std::vector<double> EvenParameters(const Spline& spline, int frames) {
  const int steps = kStepsPerSegment * static_cast<int>(spline.segments());
  const auto parameter = [&](double step) { return step / kStepsPerSegment; };
  std::vector<double> way = {0};
  for (int i = 1; i <= steps; ++i) {
    way.push_back(way.back() + spline.Motion(parameter(i - 1), parameter(i)));
  }
  std::vector<double> parameters;
  for (int f = 0; f < frames; ++f) {
    const double share = frames == 1 ? 0.5 : static_cast<double>(f) / (frames - 1);
    if (!(way.back() > 0)) {
      parameters.push_back(parameter(share * steps));
      continue;
    }
    const double target = share * way.back();
    const auto above = std::lower_bound(way.begin() + 1, way.end() - 1, target);
    const double low = *(above - 1), high = *above;
    const double inside = high > low ? (target - low) / (high - low) : 0;
    parameters.push_back(
        parameter(static_cast<double>(above - way.begin() - 1) + std::clamp(inside, 0.0, 1.0)));
  }
  return parameters;
}

/// Through at most kFewKeys of the piece, more where fewer leave free space.
Spline FreeSpline(const std::vector<Key>& piece, const FreeSpace& space) {
  for (size_t keys = kFewKeys;; keys *= 2) {
    const Spline spline(Thinned(piece, keys));
    const int steps = 16 * static_cast<int>(spline.segments());
    bool free = true;
    for (int i = 0; i <= steps && free; ++i) free = space.Has(spline.Position(i / 16.0));
    if (free || keys >= piece.size()) return spline;
  }
}

/// All with one lens.
std::vector<NovelCamera> Along(const Spline& spline, const PinholeCamera& lens, int frames) {
  std::vector<NovelCamera> path;
  for (const double s : EvenParameters(spline, frames)) {
    const Eigen::Quaterniond cam_from_world = spline.Rotation(s).conjugate();
    path.push_back({lens, {cam_from_world, -(cam_from_world * spline.Position(s))}});
  }
  return path;
}

void RequireFrames(int frames) {
  if (frames >= 1) return;
  throw UsageError("frames: expected at least 1, found " + std::to_string(frames));
}

}  // namespace

std::vector<NovelCamera> FlyThrough(const DtrSet& set, int frames, const DepthLoader& load_depth) {
  RequireFrames(frames);
  std::vector<Key> chain = Chain(Thinned(SourceKeys(set), kMaxChained));
  std::vector<const View*> views;
  for (const Key& key : chain) views.push_back(key.view);
  const FreeSpace space(views, 0.5 * UsualStep(chain), load_depth);
  for (Key& key : chain) key.scene_z = space.SceneZ(key.center);
  const std::vector<Key> piece = LongestFreePiece(chain, space);
  const View& first = *piece.front().view;
  if (piece.size() == 1) {
    return std::vector<NovelCamera>(static_cast<size_t>(frames),
                                    {first.camera, first.cam_from_world});
  }
  return Along(FreeSpline(piece, space), first.camera, frames);
}

std::vector<NovelCamera> PathThrough(std::span<const NovelCamera> cameras, int frames) {
  RequireFrames(frames);
  if (cameras.empty()) throw std::invalid_argument("PathThrough: no camera");
  if (cameras.size() == 1) {
    return std::vector<NovelCamera>(static_cast<size_t>(frames), cameras.front());
  }
  std::vector<Key> keys;
  for (const NovelCamera& camera : cameras) {
    keys.push_back({nullptr, camera.cam_from_world.TargetOriginInSource(),
                    camera.cam_from_world.rotation.conjugate()});
  }
  return Along(Spline(keys), cameras.front().camera, frames);
}

}  // namespace dtr
