#include "pipeline/export/detail/fuse.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

#include "dtr/base/parallel_for.h"

namespace dtr::pipeline {
namespace {

// A view shows a patch clearly finer where its footprint is smaller than this share of another's.
constexpr double kClearlyFiner = 0.7;
// Below this cosine a footprint is taken as at it, and a depth says nothing along another ray.
constexpr double kSmallestCosine = 0.15;
// Depths that differ by more than this share are never one surface, however near the cameras are.
constexpr double kSameSurfaceDepth = 0.05;
// Where sigma is small, and where it is unknown: pixels of disparity that rounding, interpolation
// and calibration take.
constexpr double kFloorPx = 0.25;
// Weight of the colour that another view as near as a sample's own shows.
constexpr double kOtherColour = 0.5;

// A bit for every pixel of a depth map; set from several threads.
class Marks {
 public:
  Marks() = default;
  Marks(int width, int height)
      : width_(static_cast<size_t>(width)),
        bits_((width_ * static_cast<size_t>(height) + 31) / 32) {}
  void Set(int x, int y) {
    const size_t at = Index(x, y);
    std::atomic_ref<std::uint32_t>(bits_[at / 32])
        .fetch_or(std::uint32_t{1} << (at % 32), std::memory_order_relaxed);
  }
  bool Has(int x, int y) {
    const size_t at = Index(x, y);
    return (std::atomic_ref<std::uint32_t>(bits_[at / 32]).load(std::memory_order_relaxed) >>
                (at % 32) &
            1) != 0;
  }

 private:
  size_t Index(int x, int y) const {
    return static_cast<size_t>(y) * width_ + static_cast<size_t>(x);
  }
  size_t width_ = 0;
  std::vector<std::uint32_t> bits_;
};

// A view that confirms a sample.
struct Confirmation {
  const SurfaceView* other = nullptr;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double inverse_depth = 0;         // of the sample there
  double inverse_depth_per_px = 0;  // a pixel of disparity between the two
};

// A sample while it is compared.
struct Candidate {
  Eigen::Vector3d p_in_world, direction, normal;  // direction: unit, from the camera
  double sigma = 0;                               // of its distance along the ray
  double z_share = 1;                             // of that distance that is z
  double footprint = 0;
  std::vector<Confirmation> confirmations;  // capacity is reused
  std::vector<double> distances, variances;
  int refuting = 0;
  bool finer_later = false;
};

double Footprint(const SurfaceView& surface, const Eigen::Vector3d& to_point, double z,
                 const Eigen::Vector3d& normal) {
  const double cosine = std::abs(to_point.dot(normal)) / to_point.norm();
  return z / surface.camera.fx_px() / std::max(cosine, kSmallestCosine);
}

class ViewFusion {
 public:
  ViewFusion(const FuseOptions& options, const SurfaceView& surface,
             const std::vector<std::shared_ptr<const SurfaceView>>& others,
             std::vector<Marks>& marks, bool may_leave)
      : options_(options),
        surface_(surface),
        others_(others),
        marks_(marks),
        may_leave_(may_leave) {}

  std::vector<FusedSample> Row(int y) const {
    std::vector<FusedSample> samples;
    Candidate candidate;
    for (int x = 0; x < surface_.inverse_depth.width(); ++x) {
      if (!(surface_.inverse_depth(x, y) > 0) || Own().Has(x, y)) continue;
      Begin(x, y, candidate);
      for (const auto& other : others_) Compare(*other, candidate);
      const int views = 1 + static_cast<int>(candidate.confirmations.size());
      if (views < options_.min_views || candidate.refuting > views - 1 ||
          (may_leave_ && candidate.finer_later)) {
        continue;
      }
      samples.push_back(Fused(x, y, candidate));
      Mark(x, y, candidate);
    }
    return samples;
  }

 private:
  Marks& Own() const { return marks_[static_cast<size_t>(surface_.index)]; }

  void Begin(int x, int y, Candidate& candidate) const {
    const Eigen::Vector2d pixel(x + 0.5, y + 0.5);
    const double w = surface_.inverse_depth(x, y);
    candidate.p_in_world = surface_.PointAt(pixel, w);
    candidate.normal = NormalOf(surface_, pixel, PlaneAt(surface_, x, y, kNormalRadius));
    const Eigen::Vector3d to_point = candidate.p_in_world - surface_.centre;
    candidate.direction = to_point.normalized();
    candidate.footprint = Footprint(surface_, to_point, 1 / w, candidate.normal);
    candidate.z_share = 1 / (w * to_point.norm());
    candidate.sigma = surface_.SigmaAt(pixel) / (w * w) / candidate.z_share;
    candidate.confirmations.clear();
    candidate.refuting = 0;
    candidate.finer_later = false;
  }

  void Compare(const SurfaceView& other, Candidate& candidate) const {
    const Eigen::Vector3d p = other.InCam(candidate.p_in_world);
    const auto pixel = other.camera.PixelFromCam(p);
    if (!pixel || !other.camera.Contains(*pixel)) return;
    const auto found = other.InverseDepthAt(*pixel);
    if (!found) return;
    const double baseline = (other.centre - surface_.centre).norm();
    const double per_px = 1 / (other.camera.fx_px() * std::max(baseline, 1e-9 * p.z()));
    const double nearer = *found - 1 / p.z();
    const double own = candidate.sigma * candidate.z_share / (p.z() * p.z());
    const double sigma = std::hypot(own, other.SigmaAt(*pixel));
    const bool sigma_known = own > 0 && other.SigmaAt(*pixel) > 0;
    const bool within_px = std::abs(nearer) <= options_.tolerance_px * per_px &&
                           std::abs(nearer) <= kSameSurfaceDepth / p.z();
    if (within_px &&
        (!sigma_known ||
         std::abs(nearer) <= std::max(kFloorPx * per_px, options_.tolerance_sigmas * sigma))) {
      candidate.confirmations.push_back({&other, *pixel, 1 / p.z(), per_px});
      candidate.finer_later = candidate.finer_later ||
                              (other.index > surface_.index &&
                               Footprint(other, candidate.p_in_world - other.centre, p.z(),
                                         candidate.normal) < kClearlyFiner * candidate.footprint);
    } else if (!within_px && nearer < 0) {
      ++candidate.refuting;
    }
  }

  // What a confirming view says of the distance along the sample's ray: where its surface, taken
  // as the sample's own tangent plane, meets it.
  void AddDistance(const Confirmation& confirmation, Candidate& candidate) const {
    const SurfaceView& other = *confirmation.other;
    const auto found = other.InverseDepthAt(confirmation.pixel);
    const Eigen::Vector3d point = other.PointAt(confirmation.pixel, *found);
    const Eigen::Vector3d ray = point - other.centre;
    const double along = candidate.normal.dot(candidate.direction);
    const double across = candidate.normal.dot(ray) / ray.norm();
    if (std::abs(along) < kSmallestCosine || std::abs(across) < kSmallestCosine) return;
    const double sigma =
        other.SigmaAt(confirmation.pixel) / *found * ray.norm() * std::abs(across / along);
    if (!(sigma > 0) || other.IsCompleted(static_cast<int>(confirmation.pixel.x()),
                                          static_cast<int>(confirmation.pixel.y()))) {
      return;
    }
    candidate.distances.push_back(candidate.normal.dot(point - surface_.centre) / along);
    candidate.variances.push_back(sigma * sigma);
  }

  // Means of photos err less than one of them. Those that see the patch coarser blur it, so they
  // weigh less.
  std::array<std::uint8_t, 3> Colour(int x, int y, const Candidate& candidate) const {
    std::array<double, 3> sum{};
    double weights = 0;
    const auto add = [&](const SurfaceView& view, const Eigen::Vector2d& pixel, double weight) {
      const std::array<double, 3> rgb = view.ColourAt(pixel);
      for (size_t c = 0; c < 3; ++c) sum[c] += weight * rgb[c];
      weights += weight;
    };
    add(surface_, {x + 0.5, y + 0.5}, 1);
    for (const Confirmation& confirmation : candidate.confirmations) {
      const SurfaceView& other = *confirmation.other;
      const double finer =
          candidate.footprint / Footprint(other, candidate.p_in_world - other.centre,
                                          1 / confirmation.inverse_depth, candidate.normal);
      add(other, confirmation.pixel, kOtherColour * std::min(1.0, std::pow(finer, 4)));
    }
    std::array<std::uint8_t, 3> rgb{};
    for (size_t c = 0; c < 3; ++c) rgb[c] = static_cast<std::uint8_t>(sum[c] / weights + 0.5);
    return rgb;
  }

  FusedSample Fused(int x, int y, Candidate& candidate) const {
    FusedSample sample;
    sample.x = x;
    sample.y = y;
    sample.completed = surface_.IsCompleted(x, y);
    sample.normal = candidate.normal.cast<float>();
    sample.views = 1 + static_cast<int>(candidate.confirmations.size());
    sample.p_in_world = candidate.p_in_world;
    sample.sigma = static_cast<float>(candidate.sigma);
    if (!surface_.colours.empty()) sample.rgb = Colour(x, y, candidate);
    if (!(candidate.sigma > 0)) return sample;
    candidate.distances = {(candidate.p_in_world - surface_.centre).norm()};
    candidate.variances = {candidate.sigma * candidate.sigma};
    for (const Confirmation& confirmation : candidate.confirmations) {
      AddDistance(confirmation, candidate);
    }
    double weights = 0, sum = 0;
    for (size_t i = 0; i < candidate.distances.size(); ++i) {
      weights += 1 / candidate.variances[i];
      sum += candidate.distances[i] / candidate.variances[i];
    }
    const double distance = sum / weights;
    double chi2 = 0;
    for (size_t i = 0; i < candidate.distances.size(); ++i) {
      chi2 += (candidate.distances[i] - distance) * (candidate.distances[i] - distance) /
              candidate.variances[i];
    }
    const auto count = static_cast<double>(candidate.distances.size());
    const double scatter = count > 1 ? std::max(1.0, chi2 / (count - 1)) : 1;
    sample.p_in_world = surface_.centre + distance * candidate.direction;
    sample.sigma = static_cast<float>(std::sqrt(count / weights * scatter));
    return sample;
  }

  // The pixels of the confirming views whose centres lie less than one off along both axes: samples
  // of one grid that lie a pixel apart leave none between them.
  void Mark(int x, int y, const Candidate& candidate) const {
    Own().Set(x, y);
    for (const Confirmation& confirmation : candidate.confirmations) {
      const SurfaceView& other = *confirmation.other;
      const int x0 = static_cast<int>(std::floor(confirmation.pixel.x() - 0.5));
      const int y0 = static_cast<int>(std::floor(confirmation.pixel.y() - 0.5));
      for (int v = y0; v <= y0 + 1; ++v) {
        for (int u = x0; u <= x0 + 1; ++u) {
          if (!other.inverse_depth.Contains(u, v)) continue;
          const double off = other.inverse_depth(u, v) - confirmation.inverse_depth;
          const double same =
              std::max(2 * options_.tolerance_px * confirmation.inverse_depth_per_px,
                       other.inverse_depth_per_px);
          if (other.inverse_depth(u, v) > 0 && std::abs(off) <= same) {
            marks_[static_cast<size_t>(other.index)].Set(u, v);
          }
        }
      }
    }
  }

  const FuseOptions& options_;
  const SurfaceView& surface_;
  const std::vector<std::shared_ptr<const SurfaceView>>& others_;
  std::vector<Marks>& marks_;
  bool may_leave_;
};

}  // namespace

std::vector<Eigen::Vector3d> CoarsePoints(const SurfaceView& surface) {
  constexpr int kAcross = 20;
  const int step =
      std::max(1, std::max(surface.camera.width_px(), surface.camera.height_px()) / kAcross);
  std::vector<Eigen::Vector3d> points;
  for (int y = step / 2; y < surface.inverse_depth.height(); y += step) {
    for (int x = step / 2; x < surface.inverse_depth.width(); x += step) {
      const float w = surface.inverse_depth(x, y);
      if (w > 0) points.push_back(surface.PointAt({x + 0.5, y + 0.5}, w));
    }
  }
  return points;
}

std::vector<std::vector<int>> ViewsThatSeeTheSame(SurfaceViews& views, int most) {
  const std::vector<View>& all = views.set().frames.front().views;
  const std::vector<int> with_depth = views.WithDepth();
  std::vector<std::vector<int>> seeing(all.size());
  for (const int v : with_depth) {
    const std::vector<Eigen::Vector3d> points = CoarsePoints(*views.Get(v));
    std::vector<std::pair<int, int>> counts;  // of points, negative; view
    for (const int other : with_depth) {
      if (other == v) continue;
      const View& view = all[static_cast<size_t>(other)];
      int count = 0;
      for (const Eigen::Vector3d& p : points) {
        const auto pixel = view.camera.PixelFromCam(view.cam_from_world * p);
        count += pixel && view.camera.Contains(*pixel);
      }
      if (count > 0) counts.emplace_back(-count, other);
    }
    std::sort(counts.begin(), counts.end());
    if (counts.size() > static_cast<size_t>(most)) counts.resize(static_cast<size_t>(most));
    for (const auto& [count, other] : counts) {
      seeing[static_cast<size_t>(v)].push_back(other);
      seeing[static_cast<size_t>(other)].push_back(v);
    }
  }
  for (std::vector<int>& list : seeing) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return seeing;
}

void Fuse(SurfaceViews& views, const FuseOptions& options, const FusedSink& sink,
          Progress& progress) {
  const std::vector<int> with_depth = views.WithDepth();
  progress.Stage("fusing", 2 * static_cast<int>(with_depth.size()));
  const auto seeing = ViewsThatSeeTheSame(views, options.neighbours);
  std::vector<Marks> marks(seeing.size());
  for (const int v : with_depth) {
    const PinholeCamera camera =
        views.set().frames.front().views[static_cast<size_t>(v)].DepthCamera();
    marks[static_cast<size_t>(v)] = Marks(camera.width_px(), camera.height_px());
  }
  int done = 0;
  for (const bool may_leave : {true, false}) {
    for (const int v : with_depth) {
      progress.ThrowIfInterrupted();
      std::vector<int> needed = seeing[static_cast<size_t>(v)];
      needed.push_back(v);
      auto loaded = views.GetAll(needed);
      const auto surface = loaded.back();
      loaded.pop_back();
      const ViewFusion fusion(options, *surface, loaded, marks, may_leave);
      std::vector<std::vector<FusedSample>> rows(
          static_cast<size_t>(surface->inverse_depth.height()));
      ParallelFor(0, surface->inverse_depth.height(),
                  [&](int y) { rows[static_cast<size_t>(y)] = fusion.Row(y); });
      std::vector<FusedSample> samples;
      for (const auto& row : rows) samples.insert(samples.end(), row.begin(), row.end());
      sink(*surface, samples);
      progress.Update(++done);
    }
  }
}

}  // namespace dtr::pipeline
