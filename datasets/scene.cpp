#include "datasets/scene.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace dtr::datasets {
namespace {

using Eigen::Vector3d;

// Boxes of the tree grow by this much, so that flat primitives have a volume and rounding in the
// slab test loses none of them. Scenes measure metres to a hundred metres.
constexpr double kBoxMargin = 1e-7;
// Shadow rays start this far off the surface: above rounding at 100 m (1e-14), far below a texel.
constexpr double kShadowStart = 1e-6;
constexpr int kLeafSize = 2;
// A primitive longer than this share of the scene's diagonal would spoil every box it is in.
constexpr double kLargeShare = 0.25;

/// t at which the ray enters the box, or infinity when it misses it before `limit`.
double EnterBox(const Eigen::AlignedBox3d& box, const Vector3d& origin, const Vector3d& inverse,
                double limit) {
  double enter = 0, leave = limit;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (box.min()[axis] - origin[axis]) * inverse[axis];
    const double b = (box.max()[axis] - origin[axis]) * inverse[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave ? enter : kNoHit;
}

double HalfArea(const Eigen::AlignedBox3d& box) {
  const Vector3d d = box.sizes();
  return d.x() * d.y() + d.y() * d.z() + d.z() * d.x();
}

/// Orders primitives by the centres of their boxes along an axis; ties by index.
template <typename BoundsOf>
void SortAlong(int axis, std::vector<int>::iterator begin, std::vector<int>::iterator end,
               const BoundsOf& bounds_of) {
  std::sort(begin, end, [&](int a, int b) {
    const double ca = bounds_of(a).center()[axis], cb = bounds_of(b).center()[axis];
    return ca != cb ? ca < cb : a < b;
  });
}

/// Where to cut a sorted run of primitives in two.
struct Split {
  int axis = 0;
  int left = 0;          ///< primitives of the left part
  double cost = kNoHit;  ///< sum over both parts of count times area
};

/// The cut with the smallest expected number of tests: the surface area heuristic (MacDonald and
/// Booth 1990), over all cuts along all axes.
template <typename BoundsOf>
Split BestSplit(std::vector<int> run, const BoundsOf& bounds_of) {
  Split best;
  const size_t count = run.size();
  std::vector<double> left_cost(count);
  for (int axis = 0; axis < 3; ++axis) {
    SortAlong(axis, run.begin(), run.end(), bounds_of);
    Eigen::AlignedBox3d left, right;
    for (size_t k = 0; k + 1 < count; ++k) {
      left.extend(bounds_of(run[k]));
      left_cost[k + 1] = static_cast<double>(k + 1) * HalfArea(left);
    }
    for (size_t k = count - 1; k > 0; --k) {
      right.extend(bounds_of(run[k]));
      const double cost = left_cost[k] + static_cast<double>(count - k) * HalfArea(right);
      if (cost < best.cost) best = {axis, static_cast<int>(k), cost};
    }
  }
  return best;
}

}  // namespace

Scene::Scene(std::string name, std::vector<Primitive> primitives, std::vector<Material> materials,
             Lighting lighting, Framing framing)
    : name_(std::move(name)),
      primitives_(std::move(primitives)),
      materials_(std::move(materials)),
      lighting_(std::move(lighting)),
      framing_(std::move(framing)) {
  Eigen::AlignedBox3d all;
  for (const Primitive& primitive : primitives_) {
    if (primitive.material < 0 || primitive.material >= static_cast<int>(materials_.size())) {
      throw std::invalid_argument("Scene: a primitive names a material that is not there");
    }
    all.extend(primitive.Bounds());
  }
  for (int i = 0; i < static_cast<int>(primitives_.size()); ++i) {
    const double length = primitives_[static_cast<size_t>(i)].Bounds().diagonal().norm();
    (length > kLargeShare * all.diagonal().norm() ? large_ : order_).push_back(i);
  }
  if (!order_.empty()) {
    nodes_.emplace_back();
    Build(0, 0, static_cast<int>(order_.size()));
  }
}

void Scene::Build(int node, int first, int count) {
  const auto bounds_of = [&](int index) {
    return primitives_[static_cast<size_t>(index)].Bounds();
  };
  Eigen::AlignedBox3d box;
  for (int k = first; k < first + count; ++k) box.extend(bounds_of(order_[static_cast<size_t>(k)]));
  box.min().array() -= kBoxMargin;
  box.max().array() += kBoxMargin;
  nodes_[static_cast<size_t>(node)].box = box;
  const auto begin = order_.begin() + first;
  const Split split = BestSplit({begin, begin + count}, bounds_of);
  if (count <= kLeafSize || split.cost >= count * HalfArea(box)) {
    nodes_[static_cast<size_t>(node)].first = first;
    nodes_[static_cast<size_t>(node)].count = count;
    return;
  }
  SortAlong(split.axis, begin, begin + count, bounds_of);
  const int left = static_cast<int>(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  nodes_[static_cast<size_t>(node)].first = left;
  Build(left, first, split.left);
  Build(left + 1, first + split.left, count - split.left);
}

template <typename Visit>
void Scene::Traverse(const Ray& ray, double limit, const Visit& visit) const {
  for (const int index : large_) {
    limit = visit(index, limit);
    if (limit < 0) return;
  }
  if (nodes_.empty()) return;
  const Vector3d inverse = ray.direction.cwiseInverse();
  std::pair<int, double> stack[64];
  int depth = 0;
  stack[depth++] = {0, EnterBox(nodes_[0].box, ray.origin, inverse, limit)};
  while (depth > 0) {
    const auto [index, enter] = stack[--depth];
    if (!(enter < limit)) continue;
    const Node& node = nodes_[static_cast<size_t>(index)];
    if (node.count > 0) {
      for (int k = node.first; k < node.first + node.count; ++k) {
        limit = visit(order_[static_cast<size_t>(k)], limit);
        if (limit < 0) return;
      }
      continue;
    }
    std::pair<int, double> near{node.first, 0}, far{node.first + 1, 0};
    near.second = EnterBox(nodes_[static_cast<size_t>(near.first)].box, ray.origin, inverse, limit);
    far.second = EnterBox(nodes_[static_cast<size_t>(far.first)].box, ray.origin, inverse, limit);
    if (far.second < near.second) std::swap(near, far);
    if (far.second < limit) stack[depth++] = far;
    if (near.second < limit) stack[depth++] = near;
  }
}

std::optional<Hit> Scene::Intersect(const Ray& ray, double t_max, int guess) const {
  double nearest = t_max;
  int found = -1;
  if (guess >= 0) {
    // The limit this gives spares most boxes; the surface itself is then not found again.
    const double t = primitives_[static_cast<size_t>(guess)].Intersect(ray, 0, t_max);
    if (t < t_max) {
      nearest = t;
      found = guess;
    }
  }
  Traverse(ray, nearest, [&](int index, double limit) {
    const double t = primitives_[static_cast<size_t>(index)].Intersect(ray, 0, limit);
    if (t < limit) {
      nearest = t;
      found = index;
      return t;
    }
    return limit;
  });
  if (found < 0) return std::nullopt;
  Hit hit;
  hit.t = nearest;
  hit.p_in_world = ray.At(nearest);
  hit.primitive = found;
  hit.normal = primitives_[static_cast<size_t>(found)].NormalAt(hit.p_in_world);
  if (hit.normal.dot(ray.direction) > 0) hit.normal = -hit.normal;
  return hit;
}

bool Scene::IsBlocked(const Ray& ray, double t_min, double t_max) const {
  bool blocked = false;
  Traverse(ray, t_max, [&](int index, double limit) {
    const double t = primitives_[static_cast<size_t>(index)].Intersect(ray, t_min, limit);
    blocked = t < limit;
    return blocked ? -1.0 : limit;
  });
  return blocked;
}

Vector3d Scene::Radiance(const Hit& hit, double footprint) const {
  const Primitive& primitive = primitives_[static_cast<size_t>(hit.primitive)];
  const Material& material = materials_[static_cast<size_t>(primitive.material)];
  const Vector3d albedo = AlbedoAt(material, primitive, hit.p_in_world, footprint);
  if (material.shines) return albedo;

  const double up = 0.5 + 0.5 * hit.normal.z();
  Vector3d light = lighting_.from_below + up * (lighting_.from_above - lighting_.from_below);
  const Ray to_light{
      hit.p_in_world + kShadowStart * hit.normal,
      lighting_.is_sun ? lighting_.source : (lighting_.source - hit.p_in_world).eval()};
  const double distance = to_light.direction.norm();
  const double cosine = hit.normal.dot(to_light.direction) / distance;
  if (cosine > 0) {
    bool shadow = false;
    Traverse(to_light, lighting_.is_sun ? kNoHit : 1.0, [&](int index, double limit) {
      const Primitive& other = primitives_[static_cast<size_t>(index)];
      shadow = other.casts_shadow && other.Intersect(to_light, 0, limit) < limit;
      return shadow ? -1.0 : limit;
    });
    // A lamp of some size: its light falls off with the square, but never grows beyond all bounds.
    const double reach2 = lighting_.lamp_reach * lighting_.lamp_reach;
    const double falloff = lighting_.is_sun ? 1.0 : 2 * reach2 / (reach2 + distance * distance);
    if (!shadow) light += cosine * falloff * lighting_.direct;
  }
  return albedo.cwiseProduct(light);
}

}  // namespace dtr::datasets
