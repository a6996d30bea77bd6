#include "calib/sfm/mapping/acceptance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "calib/models/fisheye.h"
#include "calib/sfm/mapping/repetition.h"
#include "dtr/base/order_statistics.h"

namespace dtr::sfm {
namespace {

using Eigen::Vector3d;

constexpr int kMinPointsPerImage = 20;
constexpr int kStrongMatches = 30;  // a pair that verification did not find by chance
constexpr double kMaxMedianPx = 1.5, kMaxRmsPx = 2.5;  // of 1000 px
constexpr double kMaxRotationMisfit = 1.5;             // median; 1 is what the certainties promise
constexpr double kMinFocal = 0.35, kMaxFocal = 12;     // of the long side: 110 and 5 degrees
constexpr double kWideFocal = 0.4;                     // 14 mm of film; few lenses that are none
constexpr double kMinFisheyeFocal = 0.15;              // a circle of 190 degrees in half of it
constexpr char kFisheyeHint[] = " (a fisheye? then `lens_model` RADIAL_FISHEYE)";
constexpr double kMaxFocalChange = 1.35;  // where it was known
constexpr double kAgreePx = 6, kContradictedBelow = 0.4;
constexpr double kMaxContradicted = 0.05, kMaxContradictedOfImage = 0.4;
constexpr double kKnownAngleRad = 0.017;  // 1 degree

// Up to three names.
std::string NamesOf(const ViewGraph& graph, const std::vector<int>& images) {
  std::string names;
  for (size_t i = 0; i < images.size() && i < 3; ++i) {
    names += (i == 0 ? "" : ", ") + graph.images[images[i]].name;
  }
  return images.size() > 3 ? names + ", ..." : names;
}

std::string WhyNotFocal(const MapEvidence& evidence) {
  std::vector<char> used(evidence.cameras.lenses.size());
  for (size_t i = 0; i < evidence.graph.images.size(); ++i) {
    if (evidence.cameras.placed[i]) used[evidence.graph.images[i].camera] = 1;
  }
  for (size_t c = 0; c < used.size(); ++c) {
    if (!used[c]) continue;
    const calib::LensCamera& lens = evidence.cameras.lenses[c];
    const double f = lens.params[0], side = std::max(lens.width_px, lens.height_px);
    const bool fisheye = calib::IsFisheye(lens.model);
    const double least = fisheye ? kMinFisheyeFocal : kMinFocal;
    if (!(f > least * side && f < kMaxFocal * side)) {
      return fmt::format(
          "the focal length of camera {} became {:.0f} px, {:.2f} times the long side{}", c + 1, f,
          f / side, f <= least * side && !fisheye ? kFisheyeHint : "");
    }
    const double before = evidence.graph.cameras[c].params[0];
    const double change = std::max(f / before, before / f);
    if (evidence.graph.focal_is_known[c] && change > kMaxFocalChange) {
      return fmt::format(
          "the focal length of camera {} became {:.0f} px, but was known as {:.0f} px{}", c + 1, f,
          before, before <= kWideFocal * side && !fisheye ? kFisheyeHint : "");
    }
    const auto images =
        std::count_if(evidence.graph.images.begin(), evidence.graph.images.end(),
                      [&](const GraphImage& image) { return image.camera == static_cast<int>(c); });
    if (!evidence.graph.focal_is_known[c] && images < 3) {
      return fmt::format("{} photo(s) do not determine the unknown focal length of camera {}",
                         images, c + 1);
    }
  }
  for (const MapPoint& point : evidence.points) {
    for (const TrackFeature& f : point.seen) {
      if (!evidence.cameras.rays[f.image][f.feature].isZero()) continue;
      return fmt::format("the distortion of camera {} folds back where features are",
                         evidence.graph.images[f.image].camera + 1);
    }
  }
  return "";
}

// Reprojection errors, in px of an image of 1000 px.
struct RelativeErrors {
  std::vector<double> all;
  std::vector<std::vector<double>> of_image;
};

RelativeErrors RelativeErrorsOf(const ViewGraph& graph, const MapCameras& cameras,
                                std::span<const MapPoint> points) {
  RelativeErrors errors;
  errors.of_image.resize(graph.images.size());
  for (const MapPoint& point : points) {
    for (const TrackFeature& f : point.seen) {
      const double e = ReprojectionErrorPx(graph, cameras, f, point.p_in_world) /
                       LimitPx(1, cameras.lenses[graph.images[f.image].camera]);
      errors.all.push_back(e);
      errors.of_image[f.image].push_back(e);
    }
  }
  return errors;
}

// How many times the median error of all an image's is; 0 where it fits.
double MisfitOf(std::vector<double> of_image, double median_of_all) {
  const double median = UpperMedian(of_image);
  return median > std::max(kMaxMedianPx, 3 * median_of_all) ? median / median_of_all : 0;
}

std::string WhyNotErrors(const MapEvidence& evidence, MapStatistics* statistics) {
  std::vector<double> errors;
  double sum = 0;
  for (const MapPoint& point : evidence.points) {
    for (const TrackFeature& f : point.seen) {
      const double e = ReprojectionErrorPx(evidence.graph, evidence.cameras, f, point.p_in_world);
      errors.push_back(e);
      sum += e * e;
    }
  }
  if (errors.empty()) return "no point is left";
  const auto count = static_cast<double>(errors.size());
  statistics->observations = static_cast<int>(errors.size());
  statistics->error_median_px = UpperMedian(errors);
  statistics->error_rms_px = std::sqrt(sum / count);
  RelativeErrors relative = RelativeErrorsOf(evidence.graph, evidence.cameras, evidence.points);
  const double median = UpperMedian(relative.all);
  const double squares =
      std::inner_product(relative.all.begin(), relative.all.end(), relative.all.begin(), 0.0);
  if (!(median <= kMaxMedianPx && std::sqrt(squares / count) <= kMaxRmsPx)) {
    return fmt::format("reprojection errors are large: median {:.2f} px, RMS {:.2f} px",
                       statistics->error_median_px, statistics->error_rms_px);
  }
  for (size_t i = 0; i < relative.of_image.size(); ++i) {
    if (!evidence.cameras.placed[i]) continue;
    if (relative.of_image[i].size() < kMinPointsPerImage) {
      return fmt::format("{} sees {} points of the map only", evidence.graph.images[i].name,
                         relative.of_image[i].size());
    }
    if (const double misfit = MisfitOf(relative.of_image[i], median); misfit > 0) {
      return fmt::format(
          "{} does not fit: its median reprojection error is {:.1f} times that of all",
          evidence.graph.images[i].name, misfit);
    }
  }
  return "";
}

// Builds the map up again, image by image.
class Growth {
 public:
  Growth(const MapCameras& cameras, std::span<const MapPoint> points)
      : cameras_(cameras),
        points_(points),
        in_(cameras.placed.size()),
        known_(points.size()),
        sees_known_(in_.size()),
        points_of_(in_.size()) {
    for (size_t p = 0; p < points.size(); ++p) {
      for (const TrackFeature& f : points[p].seen) {
        points_of_[f.image].push_back(static_cast<int>(p));
      }
    }
  }

  void Add(int image) {
    in_[image] = 1;
    for (const int p : points_of_[image]) {
      if (known_[p]) continue;
      for (const TrackFeature& f : points_[p].seen) {
        if (f.image == image || !in_[f.image] || Angle(f.image, image, p) < kKnownAngleRad)
          continue;
        known_[p] = 1;
        break;
      }
      if (!known_[p]) continue;
      for (const TrackFeature& f : points_[p].seen) ++sees_known_[f.image];
    }
  }

  // The image with the most known points; -1: none is left.
  int Next() const {
    int best = -1;
    for (size_t i = 0; i < in_.size(); ++i) {
      if (!cameras_.placed[i] || in_[i]) continue;
      if (best < 0 || sees_known_[i] > sees_known_[best]) best = static_cast<int>(i);
    }
    return best;
  }
  int SeesKnown(int image) const { return sees_known_[image]; }

  // The two images that share the most points of known depth.
  std::pair<int, int> BestPair() const {
    std::unordered_map<std::uint64_t, int> shared;
    for (size_t p = 0; p < points_.size(); ++p) {
      const Track& seen = points_[p].seen;
      for (size_t i = 0; i < seen.size(); ++i) {
        for (size_t k = i + 1; k < seen.size(); ++k) {
          if (Angle(seen[i].image, seen[k].image, static_cast<int>(p)) < kKnownAngleRad) continue;
          ++shared[static_cast<std::uint64_t>(seen[i].image) << 32 |
                   static_cast<std::uint32_t>(seen[k].image)];
        }
      }
    }
    std::pair<int, std::uint64_t> best{0, 0};
    for (const auto& [key, count] : shared) {
      if (count > best.first || (count == best.first && key < best.second)) best = {count, key};
    }
    if (best.first == 0) return {-1, -1};
    return {static_cast<int>(best.second >> 32), static_cast<int>(best.second & 0xffffffffu)};
  }

 private:
  double Angle(int image_a, int image_b, int point) const {
    const Vector3d& p = points_[point].p_in_world;
    const Vector3d a = p - cameras_.cam_from_world[image_a].TargetOriginInSource();
    const Vector3d b = p - cameras_.cam_from_world[image_b].TargetOriginInSource();
    return std::atan2(a.cross(b).norm(), a.dot(b));
  }

  const MapCameras& cameras_;
  std::span<const MapPoint> points_;
  std::vector<char> in_, known_;
  std::vector<int> sees_known_;
  std::vector<std::vector<int>> points_of_;
};

}  // namespace

std::vector<int> MisfitsOf(const ViewGraph& graph, const MapCameras& cameras,
                           std::span<const MapPoint> points) {
  RelativeErrors errors = RelativeErrorsOf(graph, cameras, points);
  std::vector<int> misfits;
  if (errors.all.empty()) return misfits;
  const double median = UpperMedian(errors.all);
  for (size_t i = 0; i < errors.of_image.size(); ++i) {
    if (errors.of_image[i].empty() || !(MisfitOf(errors.of_image[i], median) > 0)) continue;
    misfits.push_back(static_cast<int>(i));
  }
  return misfits;
}

std::vector<int> LooselyJoined(const MapCameras& cameras, std::span<const MapPoint> points,
                               int min_points, int* most_points) {
  Growth growth(cameras, points);
  std::vector<int> loose;
  *most_points = 0;
  const auto [first, second] = growth.BestPair();
  if (first >= 0) {
    growth.Add(first);
    growth.Add(second);
    int next = growth.Next();
    while (next >= 0 && growth.SeesKnown(next) >= min_points) {
      growth.Add(next);
      next = growth.Next();
    }
    if (next >= 0) *most_points = growth.SeesKnown(next);
  }
  while (true) {
    const int next = growth.Next();
    if (next < 0) break;
    loose.push_back(next);
    growth.Add(next);
  }
  std::sort(loose.begin(), loose.end());
  return loose;
}

double AgreeingShare(const ViewGraph& graph, const MapCameras& cameras, const PairGeometry& pair,
                     double limit_px) {
  const Pose b_from_a =
      cameras.cam_from_world[pair.image_b] * cameras.cam_from_world[pair.image_a].Inverse();
  const Eigen::Matrix3d rotation = b_from_a.rotation.toRotationMatrix();
  const Vector3d translation = b_from_a.translation.normalized();
  double limit = 0;
  for (const int image : {pair.image_a, pair.image_b}) {
    const calib::LensCamera& lens = cameras.lenses[graph.images[image].camera];
    limit = std::max(limit, LimitPx(limit_px, lens) / lens.params[0]);
  }
  int agree = 0, looked_at = 0;
  for (const auto& [feature_a, feature_b] : pair.matches) {
    const Vector3d& a = cameras.rays[pair.image_a][feature_a];
    const Vector3d& b = cameras.rays[pair.image_b][feature_b];
    ++looked_at;
    if (a.isZero() || b.isZero()) continue;
    if (!(std::abs(EpipolarAngle(rotation, translation, a, b)) < limit)) continue;
    // Nearly parallel rays meet behind the cameras as easily as before them.
    const Vector3d turned = rotation * a;
    const bool parallel = turned.cross(b).norm() < limit && turned.dot(b) > 0;
    agree += parallel || (DepthsOf(rotation, translation, a, b).array() > 0).all() ? 1 : 0;
  }
  return looked_at > 0 ? static_cast<double>(agree) / looked_at : 0;
}

std::string WhyNotContradicted(const MapEvidence& evidence, MapStatistics* statistics) {
  std::vector<double> matches(evidence.graph.images.size()), against(matches.size());
  double all = 0, contradicted = 0;
  int pairs = 0;
  const Repetition repetition(evidence.graph, evidence.points);
  for (const PairGeometry& pair : evidence.graph.pairs) {
    const auto count = static_cast<double>(pair.matches.size());
    if (count < kStrongMatches || !evidence.cameras.placed[pair.image_a] ||
        !evidence.cameras.placed[pair.image_b]) {
      continue;
    }
    const bool is_contradicted =
        AgreeingShare(evidence.graph, evidence.cameras, pair, kAgreePx) < kContradictedBelow &&
        !repetition.Explains(pair);
    all += count;
    contradicted += is_contradicted ? count : 0;
    pairs += is_contradicted ? 1 : 0;
    for (const int image : {pair.image_a, pair.image_b}) {
      matches[image] += count;
      against[image] += is_contradicted ? count : 0;
    }
  }
  statistics->contradicted_share = all > 0 ? contradicted / all : 0;
  if (statistics->contradicted_share > kMaxContradicted) {
    return fmt::format(
        "{} pairs of photos with {:.0f} % of all matches contradict the map (repeated "
        "structure?)",
        pairs, 100 * statistics->contradicted_share);
  }
  for (size_t i = 0; i < matches.size(); ++i) {
    if (against[i] > kMaxContradictedOfImage * matches[i]) {
      return fmt::format("{:.0f} % of the matches of {} contradict the map",
                         100 * against[i] / matches[i], evidence.graph.images[i].name);
    }
  }
  return "";
}

std::string WhyNotJoined(const MapEvidence& evidence) {
  int most = 0;
  const std::vector<int> loose =
      LooselyJoined(evidence.cameras, evidence.points, kMinPointsPerImage, &most);
  if (loose.empty()) return "";
  return fmt::format(
      "{} photo(s) ({}) hang on the others by {} points of known depth, which do not determine "
      "their scale",
      loose.size(), NamesOf(evidence.graph, loose), most);
}

std::string WhyNot(const MapEvidence& evidence, MapStatistics* statistics) {
  if (const std::string why = WhyNotErrors(evidence, statistics); !why.empty()) return why;
  for (const LeftOut& left : evidence.left_out) {
    int strong = 0;
    for (const PairGeometry& pair : evidence.graph.pairs) {
      const bool joins = (pair.image_a == left.image && evidence.cameras.placed[pair.image_b]) ||
                         (pair.image_b == left.image && evidence.cameras.placed[pair.image_a]);
      strong += joins && pair.matches.size() >= kStrongMatches ? 1 : 0;
    }
    if (strong >= 2) {
      return fmt::format("{} could not be placed, though {} pairs match it well",
                         evidence.graph.images[left.image].name, strong);
    }
  }
  if (statistics->rotation_misfit > kMaxRotationMisfit) {
    return fmt::format("relative rotations disagree by {:.1f} standard deviations",
                       statistics->rotation_misfit);
  }
  if (const std::string why = WhyNotFocal(evidence); !why.empty()) return why;
  if (const std::string why = WhyNotContradicted(evidence, statistics); !why.empty()) return why;
  return WhyNotJoined(evidence);
}

}  // namespace dtr::sfm
