#include "calib/sfm/mapping/global_mapper.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "calib/sfm/mapping/acceptance.h"
#include "calib/sfm/mapping/adjust_map.h"
#include "calib/sfm/mapping/adjust_stations.h"
#include "calib/sfm/mapping/ideal_graph.h"
#include "calib/sfm/mapping/map_model.h"
#include "calib/sfm/mapping/pair_selection.h"
#include "calib/sfm/mapping/points.h"
#include "calib/sfm/mapping/positioning.h"
#include "calib/sfm/mapping/resection.h"
#include "dtr/base/order_statistics.h"

namespace dtr::sfm {
namespace {

using Eigen::Vector3d;

constexpr int kFirstTracksPerImage = 250;  // the adjustments that settle cameras
constexpr int kMinPointsOfImage = 12;      // else it is resected
constexpr int kMinResected = 20;
constexpr int kLongTracksEnough = 150;  // images with fewer use tracks of two features, too
constexpr int kImagesForLens = 2;
constexpr double kRadius = 10;  // of the cameras, in units of the world
constexpr int kSteps = 8;       // that Step is called for

void CheckGraph(const ViewGraph& graph) {
  const auto require = [](bool holds, const char* what) {
    if (!holds) throw std::invalid_argument(std::string("MapGlobally: ") + what);
  };
  require(graph.focal_is_known.size() == graph.cameras.size(), "focal_is_known per camera");
  for (const calib::LensCamera& camera : graph.cameras) {
    camera.Check();
  }
  for (const GraphImage& image : graph.images) {
    require(image.camera >= 0 && image.camera < static_cast<int>(graph.cameras.size()),
            "a camera out of range");
    for (const Eigen::Vector2d& pixel : image.pixels) require(pixel.allFinite(), "a pixel");
  }
  const auto images = static_cast<int>(graph.images.size());
  for (const PairGeometry& pair : graph.pairs) {
    require(0 <= pair.image_a && pair.image_a < pair.image_b && pair.image_b < images,
            "an image out of range");
    for (const auto& [a, b] : pair.matches) {
      require(a < graph.images[pair.image_a].pixels.size() &&
                  b < graph.images[pair.image_b].pixels.size(),
              "a feature out of range");
    }
  }
}

// One run of the mapper; the members are what its steps pass on.
class Mapper {
 public:
  Mapper(const ViewGraph& graph, const MapOptions& options)
      : graph_(graph), options_(options), nodes_(NodesOf(graph)) {
    for (const GraphImage& image : graph.images) stations_ = stations_ || image.station >= 0;
  }

  Mapped Run() {
    for (const calib::LensCamera& camera : graph_.cameras) {
      if (CanAdjust(camera)) continue;
      mapped_.why_not = "cameras of the model " + NameOf(camera.model) + " are not supported";
      return std::move(mapped_);
    }
    if (options_.progress != nullptr) options_.progress->Stage("mapping", kSteps);
    cameras_.lenses = graph_.cameras;
    cameras_.rays = RaysOf(graph_, graph_.cameras);
    Rotations rotations = SelectPairs(graph_, cameras_.rays, options_, &mapped_.statistics);
    mapped_.left_out = rotations.left_out;
    mapped_.why_not = rotations.why_not;
    if (!mapped_.why_not.empty()) return std::move(mapped_);
    Step();
    tracks_ = BuildTracks(graph_, rotations.pairs);
    Step();
    mapped_.statistics.tracks = static_cast<int>(tracks_.size());
    Place(rotations);
    Step();
    if (!Settle() || !AdjustAll()) {
      mapped_.why_not = "bundle adjustment finds no cameras that agree with the matches";
      return std::move(mapped_);
    }
    mapped_.why_not = WhyNot({graph_, cameras_, points_, mapped_.left_out}, &mapped_.statistics);
    WriteModel();
    return std::move(mapped_);
  }

 private:
  // The next of kSteps is done.
  void Step() {
    if (options_.progress == nullptr) return;
    options_.progress->ThrowIfInterrupted();
    options_.progress->Update(++steps_done_);
  }

  void Place(const Rotations& rotations) {
    const Positions positions = PlaceCameras(rotations.cam_from_world, cameras_.rays, nodes_,
                                             tracks_, options_.seed, options_.progress);
    mapped_.statistics.positioning_cost = positions.cost;
    cameras_.placed = rotations.connected;
    for (const Track& track : tracks_) {
      for (const TrackFeature& f : track) cameras_.placed[f.image] |= 2;
    }
    for (size_t i = 0; i < graph_.images.size(); ++i) {
      cameras_.placed[i] = cameras_.placed[i] == 3 ? 1 : 0;
      Pose pose;
      pose.rotation = Eigen::Quaterniond(rotations.cam_from_world[i]).normalized();
      pose.translation = -(pose.rotation * positions.centres[i]);
      cameras_.cam_from_world.push_back(pose);
    }
    Normalise();
  }

  // Adjusts cameras with a part of the tracks: first poses, from errors of many pixels, then the
  // lenses too.
  bool Settle() {
    struct Stage {
      double max_error, cauchy;
      bool lenses;
      int iterations;
    };
    const std::vector<int> part =
        CoveringTracks(static_cast<int>(graph_.images.size()), tracks_, kFirstTracksPerImage);
    for (const Stage& stage :
         {Stage{40, 8, false, 30}, Stage{25, 4, true, 40}, Stage{10, 2, true, 30}}) {
      points_ = PointsOf(graph_, cameras_, tracks_, part, {stage.max_error, kFirstAngleRad});
      UnplacePoor();
      FilterPoints(graph_, cameras_, {stage.max_error, kFirstAngleRad}, &points_);
      if (!Adjust(stage.cauchy, stage.lenses, stage.iterations)) return false;
      Normalise();
      Step();
    }
    return true;
  }

  // All tracks, twice; images that were lost meanwhile are resected in between.
  bool AdjustAll() {
    const std::vector<int> useful = UsefulTracks();
    points_ = PointsOf(graph_, cameras_, tracks_, useful, {6});
    UnplacePoor();
    FilterPoints(graph_, cameras_, {6}, &points_);
    ResectLost();
    if (!Adjust(1, true, 20)) return false;
    Step();
    FilterPoints(graph_, cameras_, {4}, &points_);
    if (UnplaceMisfits()) ResectLost();
    points_ = PointsOf(graph_, cameras_, tracks_, useful, {4});
    UnplacePoor();
    FilterPoints(graph_, cameras_, {4}, &points_);
    // Slow directions, such as focal length against depth, need many iterations.
    if (!Adjust(FinalCauchy(), true, 100, 1e-9)) return false;
    FilterPoints(graph_, cameras_, {4}, &points_);
    UnplaceMisfits();
    NameLost();
    Normalise();
    Step();
    return true;
  }

  // Tracks of three features and more, and those of two where an image has few others.
  std::vector<int> UsefulTracks() const {
    std::vector<int> longer(graph_.images.size()), useful;
    for (const Track& track : tracks_) {
      if (track.size() < 3) continue;
      for (const TrackFeature& f : track) ++longer[f.image];
    }
    for (size_t t = 0; t < tracks_.size(); ++t) {
      const bool needed =
          std::any_of(tracks_[t].begin(), tracks_[t].end(),
                      [&](const TrackFeature& f) { return longer[f.image] < kLongTracksEnough; });
      if (tracks_[t].size() > 2 || needed) useful.push_back(static_cast<int>(t));
    }
    return useful;
  }

  bool Adjust(double cauchy, bool lenses, int iterations, double cost_tolerance = 1e-5) {
    std::vector<int> image_of;
    calib::Bundle bundle = BundleOfMap(graph_, cameras_, points_, &image_of);
    std::vector<int> images(graph_.cameras.size());
    for (const int i : image_of) ++images[graph_.images[i].camera];
    AdjustMapOptions options{.lenses = {},
                             .focals_hold = options_.focals_are_known,
                             .cauchy_px = cauchy,
                             .iterations = iterations,
                             .cost_tolerance = cost_tolerance,
                             .progress = options_.progress};
    double scale = 1;
    for (size_t c = 0; c < images.size(); ++c) {
      const bool enough = lenses && !options_.intrinsics_are_known && images[c] >= kImagesForLens;
      options.lenses.push_back(enough ? MapLens::kFocalAndDistortion : MapLens::kFixed);
      options.known_focals_px.push_back(KnownFocalsPx(c));
      if (images[c] > 0) scale = std::max(scale, LimitPx(1, cameras_.lenses[c]));
    }
    options.cauchy_px *= scale;
    const bool adjusted = stations_ ? AdjustStations(graph_, nodes_, image_of, options, &bundle)
                                    : AdjustMap(options, &bundle);
    if (!adjusted) return false;
    TakeFromBundle(bundle, image_of, &cameras_, &points_);
    if (lenses) cameras_.rays = RaysOf(graph_, cameras_.lenses);
    return true;
  }

  std::vector<double> KnownFocalsPx(size_t camera) const {
    if (!graph_.focal_is_known[camera]) return {};
    const calib::LensCamera& lens = graph_.cameras[camera];
    return {lens.params.begin(), lens.params.begin() + calib::FocalCount(lens.model)};
  }

  // Where errors begin to count as outliers: some times their median, px of an image of 1000 px.
  double FinalCauchy() const {
    std::vector<double> errors;
    for (const MapPoint& point : points_) {
      for (const TrackFeature& f : point.seen) {
        const calib::LensCamera& lens = cameras_.lenses[graph_.images[f.image].camera];
        errors.push_back(ReprojectionErrorPx(graph_, cameras_, f, point.p_in_world) /
                         LimitPx(1, lens));
      }
    }
    return errors.empty() ? 1 : std::clamp(2.5 * UpperMedian(errors), 0.25, 1.0);
  }

  void UnplacePoor() {
    const std::vector<int> counts = PointCounts(graph_.images.size(), points_);
    for (size_t i = 0; i < counts.size(); ++i) {
      if (counts[i] < kMinPointsOfImage) cameras_.placed[i] = 0;
    }
  }

  // One image that stands wrong must not cost the others their map; whether there was any.
  bool UnplaceMisfits() {
    const std::vector<int> misfits = MisfitsOf(graph_, cameras_, points_);
    for (const int image : misfits) cameras_.placed[image] = 0;
    if (!misfits.empty()) FilterPoints(graph_, cameras_, {4}, &points_);
    return !misfits.empty();
  }

  void ResectLost() {
    for (size_t i = 0; i < graph_.images.size(); ++i) {
      if (cameras_.placed[i]) continue;
      const auto image = static_cast<int>(i);
      std::vector<FeaturePoint> seen = PointsSeenBy(graph_, image, points_);
      const calib::LensCamera& lens = cameras_.lenses[graph_.images[i].camera];
      const auto pose =
          Resect(graph_, cameras_, image, points_, LimitPx(8, lens), kMinResected, &seen);
      if (!pose) continue;
      cameras_.placed[i] = 1;
      cameras_.cam_from_world[i] = *pose;
      ++mapped_.statistics.resected;
      for (const FeaturePoint& s : seen) {
        InsertFeature({image, s.feature}, &points_[s.point].seen);
        InsertFeature({image, s.feature}, &tracks_[points_[s.point].track]);
      }
    }
  }

  static void InsertFeature(const TrackFeature& feature, Track* track) {
    const auto at = std::lower_bound(
        track->begin(), track->end(), feature,
        [](const TrackFeature& x, const TrackFeature& y) { return x.image < y.image; });
    if (at != track->end() && at->image == feature.image) {
      at->feature = feature.feature;
    } else {
      track->insert(at, feature);
    }
  }

  // Images without a place, and the reason of those that had one.
  void NameLost() {
    std::erase_if(mapped_.left_out,
                  [&](const LeftOut& l) { return cameras_.placed[l.image] != 0; });
    for (size_t i = 0; i < graph_.images.size(); ++i) {
      const auto image = static_cast<int>(i);
      const bool named = std::any_of(mapped_.left_out.begin(), mapped_.left_out.end(),
                                     [&](const LeftOut& l) { return l.image == image; });
      if (cameras_.placed[i] || named) continue;
      mapped_.left_out.push_back({image, "its features agree with too few points of the map"});
    }
    std::sort(mapped_.left_out.begin(), mapped_.left_out.end(),
              [](const LeftOut& x, const LeftOut& y) { return x.image < y.image; });
  }

  // Cameras around the origin, within about kRadius.
  void Normalise() {
    Vector3d mean = Vector3d::Zero();
    double count = 0, radius = 0;
    for (size_t i = 0; i < graph_.images.size(); ++i) {
      if (!cameras_.placed[i]) continue;
      mean += cameras_.cam_from_world[i].TargetOriginInSource();
      ++count;
    }
    if (count == 0) return;
    mean /= count;
    for (size_t i = 0; i < graph_.images.size(); ++i) {
      if (!cameras_.placed[i]) continue;
      const Vector3d centre = cameras_.cam_from_world[i].TargetOriginInSource() - mean;
      radius = std::max(radius, centre.norm());
    }
    if (!(radius > 0) || !std::isfinite(radius)) return;
    const double scale = kRadius / radius;
    for (size_t i = 0; i < graph_.images.size(); ++i) {
      Pose& pose = cameras_.cam_from_world[i];
      pose.translation = -(pose.rotation * (scale * (pose.TargetOriginInSource() - mean)));
    }
    for (MapPoint& point : points_) point.p_in_world = scale * (point.p_in_world - mean);
  }

  void WriteModel() {
    mapped_.model = ModelOf(graph_, cameras_, &points_);
    mapped_.statistics.registered = static_cast<int>(mapped_.model.images.size());
    mapped_.statistics.points = static_cast<int>(points_.size());
  }

  static constexpr double kFirstAngleRad = 0.017;

  const ViewGraph& graph_;
  const MapOptions& options_;
  const std::vector<int> nodes_;
  bool stations_ = false;  // some images belong to one
  int steps_done_ = 0;
  Mapped mapped_;
  MapCameras cameras_;
  std::vector<Track> tracks_;
  std::vector<MapPoint> points_;
};

}  // namespace

Mapped MapGlobally(const ViewGraph& graph, const MapOptions& options) {
  CheckGraph(graph);
  if (options.intrinsics_are_known &&
      !std::all_of(graph.cameras.begin(), graph.cameras.end(), CanAdjust)) {
    const ViewGraph ideal = IdealGraph(graph);
    Mapped mapped = Mapper(ideal, options).Run();
    PutBackCameras(graph, &mapped.model);
    return mapped;
  }
  return Mapper(graph, options).Run();
}

}  // namespace dtr::sfm
