#include "calib/bundle/rig_adjust.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"

namespace dtr::calib {
namespace {

constexpr double kMaxScaleSpread = 0.2;

[[noreturn]] void RejectRig(const std::string& what) { throw Error("rig: " + what); }

SfmModel WithLenses(SfmModel model, const KnownRig& rig,
                    const std::map<std::string, RigPhoto>& photo_of) {
  const auto old = std::move(model.cameras);
  model.cameras.clear();
  for (size_t c = 0; c < rig.lenses.size(); ++c) {
    model.cameras[static_cast<std::uint32_t>(c + 1)] = rig.lenses[c];
  }
  for (SfmImage& image : model.images) {
    const auto photo = photo_of.find(image.name);
    if (photo == photo_of.end()) RejectRig(image.name + ": expected a photo of the rig");
    const LensCamera& lens = rig.lenses[photo->second.camera];
    const LensCamera& was = old.at(image.camera_id);
    if (lens.width_px != was.width_px || lens.height_px != was.height_px) {
      RejectRig(fmt::format("{}: expected {} x {} px as the calibration has, found {} x {}",
                            image.name, lens.width_px, lens.height_px, was.width_px,
                            was.height_px));
    }
    image.camera_id = static_cast<std::uint32_t>(photo->second.camera + 1);
  }
  return model;
}

// Images of each frame, indices into the bundle.
struct Frames {
  std::vector<RigImage> images;
  std::vector<std::vector<size_t>> members;
};

Frames FramesOf(const Bundle& bundle, const KnownRig& rig,
                const std::map<std::string, RigPhoto>& photo_of) {
  Frames frames;
  std::map<std::string, int> numbers;
  for (size_t i = 0; i < bundle.images.size(); ++i) {
    const RigPhoto& photo = photo_of.at(bundle.images[i].name);
    const int frame = numbers.emplace(photo.frame, static_cast<int>(numbers.size())).first->second;
    if (static_cast<size_t>(frame) == frames.members.size()) frames.members.emplace_back();
    frames.images.push_back({frame, rig.cam_from_rig[photo.camera]});
    frames.members[static_cast<size_t>(frame)].push_back(i);
  }
  return frames;
}

double DistanceOf(const Bundle& bundle, size_t a, size_t b) {
  return (bundle.images[a].cam_from_world.TargetOriginInSource() -
          bundle.images[b].cam_from_world.TargetOriginInSource())
      .norm();
}

// Images of a frame should coincide: how far they do not, of the distance to the next frame.
void RequireOneCentre(const Bundle& bundle, const Frames& frames, RigRefined& refined) {
  std::vector<double> within, between;
  for (size_t f = 0; f < frames.members.size(); ++f) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const size_t a : frames.members[f]) {
      for (const size_t b : frames.members[f]) {
        if (b > a) within.push_back(DistanceOf(bundle, a, b));
      }
      for (size_t other = 0; other < frames.members.size(); ++other) {
        if (other == f) continue;
        for (const size_t b : frames.members[other]) {
          nearest = std::min(nearest, DistanceOf(bundle, a, b));
        }
      }
    }
    if (std::isfinite(nearest)) between.push_back(nearest);
  }
  refined.scale = 1;
  refined.pairs = static_cast<int>(within.size());
  if (within.empty() || between.empty()) return;
  refined.scale_spread = UpperMedian(within) / UpperMedian(between);
  if (refined.scale_spread > kMaxScaleSpread) {
    RejectRig(
        fmt::format("the views of one panorama were found {:.0f} % of the way to the next panorama "
                    "apart, in the median; are these whole panoramas, well stitched, of a still "
                    "scene?",
                    100 * refined.scale_spread));
  }
}

void FindScale(const Bundle& bundle, const Frames& frames, RigRefined& refined) {
  std::vector<double> scales;
  for (const auto& members : frames.members) {
    for (const size_t a : members) {
      for (const size_t b : members) {
        if (b <= a) continue;
        const double apart = (frames.images[a].cam_from_rig.TargetOriginInSource() -
                              frames.images[b].cam_from_rig.TargetOriginInSource())
                                 .norm();
        const double found = (bundle.images[a].cam_from_world.TargetOriginInSource() -
                              bundle.images[b].cam_from_world.TargetOriginInSource())
                                 .norm();
        if (apart > 0 && found > 0) scales.push_back(apart / found);
      }
    }
  }
  if (scales.empty()) {
    RejectRig("expected a time step that two cameras saw from different positions, found none");
  }
  refined.pairs = static_cast<int>(scales.size());
  refined.scale = UpperMedian(scales);
  for (double& s : scales) s = std::abs(s - refined.scale);
  refined.scale_spread = 1.4826 * UpperMedian(scales) / refined.scale;
  if (refined.scale_spread > kMaxScaleSpread) {
    RejectRig(
        fmt::format("expected photos of this rig, found distances between its cameras that "
                    "scatter by {:.0f} %",
                    100 * refined.scale_spread));
  }
}

// What all say: single turns carry it less than single shifts.
Eigen::Vector3d MeanCentre(const std::vector<Pose>& said) {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Pose& pose : said) {
    centre += pose.TargetOriginInSource() / static_cast<double>(said.size());
  }
  return centre;
}

// What most say: views of the sky or of a blank wall may lie anywhere.
Eigen::Vector3d MedianCentre(const std::vector<Pose>& said) {
  Eigen::Vector3d centre;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Pose& pose : said) values.push_back(pose.TargetOriginInSource()[axis]);
    centre[axis] = UpperMedian(values);
  }
  return centre;
}

// Of the poses that a frame's images say the rig has, the one nearest to the others.
Pose RigOf(const Bundle& bundle, const Frames& frames, const std::vector<size_t>& members,
           bool one_centre) {
  std::vector<Pose> said;
  for (const size_t i : members) {
    said.push_back(frames.images[i].cam_from_rig.Inverse() * bundle.images[i].cam_from_world);
  }
  size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (size_t a = 0; a < said.size(); ++a) {
    double sum = 0;
    for (const Pose& other : said) sum += said[a].rotation.angularDistance(other.rotation);
    if (sum < least) {
      least = sum;
      best = a;
    }
  }
  Pose rig = said[best];
  const Eigen::Vector3d centre = one_centre ? MedianCentre(said) : MeanCentre(said);
  rig.translation = -(rig.rotation * centre);
  return rig;
}

void Scale(double scale, Bundle& bundle) {
  for (BundleImage& image : bundle.images) image.cam_from_world.translation *= scale;
  for (Eigen::Vector4d& point : bundle.points) point.head<3>() *= scale;
}

void RequireConverged(const Adjusted& adjusted, const char* what) {
  if (!adjusted.converged) {
    RejectRig(fmt::format("expected the solve {} to converge, found none of it after {} iterations",
                          what, adjusted.iterations));
  }
}

}  // namespace

bool HasOneCentre(const KnownRig& rig) {
  return std::all_of(rig.cam_from_rig.begin(), rig.cam_from_rig.end(), [&](const Pose& pose) {
    return pose.TargetOriginInSource() == rig.cam_from_rig.front().TargetOriginInSource();
  });
}

std::map<std::string, Pose> RigPosesOf(const SfmModel& model, const KnownRig& rig,
                                       const std::map<std::string, RigPhoto>& photo_of) {
  const Bundle bundle = BundleOf(WithLenses(model, rig, photo_of));
  const Frames frames = FramesOf(bundle, rig, photo_of);
  std::map<std::string, Pose> poses;
  for (const auto& members : frames.members) {
    poses[photo_of.at(bundle.images[members.front()].name).frame] =
        RigOf(bundle, frames, members, true);
  }
  return poses;
}

RigRefined RefineRig(const SfmModel& model, const KnownRig& rig,
                     const std::map<std::string, RigPhoto>& photo_of, const Progress* progress) {
  const SfmModel known = WithLenses(model, rig, photo_of);
  RigRefined refined;
  AdjustOptions options;
  options.lens = LensFreedom::kFixed;
  options.progress = progress;
  const Adjusted free = Adjust(BundleOf(known), options);
  RequireConverged(free, "with the rig's intrinsics");
  refined.free_sigma_px = free.sigma_px;
  Bundle bundle = free.bundle;
  const Frames frames = FramesOf(bundle, rig, photo_of);
  refined.frames = static_cast<int>(frames.members.size());
  const bool one_centre = HasOneCentre(rig);
  if (one_centre) {
    RequireOneCentre(bundle, frames, refined);
    bundle = BundleOf(known);  // whose views coincide already, also those of the sky
  } else {
    FindScale(bundle, frames, refined);
    Scale(refined.scale, bundle);
  }
  std::vector<Pose> rig_from_world;
  for (const auto& members : frames.members) {
    rig_from_world.push_back(RigOf(bundle, frames, members, one_centre));
  }
  refined.adjusted = AdjustRig(bundle, frames.images, rig_from_world, options);
  RequireConverged(refined.adjusted, "with the rig's positions");
  if (Contradicts(refined.adjusted, free)) {
    RejectRig(fmt::format(
        "expected photos of this rig, found residuals of {:.2f} px per coordinate and {} "
        "observations that agree with its positions fixed, {:.2f} px and {} without; was a camera "
        "moved since?",
        refined.adjusted.sigma_px, refined.adjusted.observations, free.sigma_px,
        free.observations));
  }
  refined.model = ModelOf(refined.adjusted.bundle, known, false, &refined.points_dropped);
  refined.adjusted.bundle = {};
  refined.solve = refined.adjusted;
  return refined;
}

}  // namespace dtr::calib
