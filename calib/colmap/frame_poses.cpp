// Poses of images as COLMAP 3.12 and later store them: each image belongs to a frame, a frame to a
// rig. cam_from_world = sensor_from_rig * rig_from_world.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numbers>

#include "calib/colmap/raw_model.h"
#include "dtr/base/error.h"
#include "dtr/base/file_names.h"

namespace dtr::colmap {
namespace {

struct PoseOfFrame {
  std::uint32_t frame_id = 0, camera_id = 0;
  Pose cam_from_world;
};

std::map<std::uint32_t, const RawRig*> RigsById(const RawModel& raw) {
  std::map<std::uint32_t, const RawRig*> rigs;
  for (const RawRig& rig : raw.rigs) {
    if (!rigs.emplace(rig.id, &rig).second) {
      throw Error(fmt::format("{}: rig {}: expected a unique id, found it twice",
                              raw.rigs_file.string(), rig.id));
    }
  }
  return rigs;
}

Pose CamFromWorld(const RawFrame& frame, const RawRig& rig, std::uint32_t camera_id,
                  const std::string& where) {
  for (size_t i = 0; i < rig.sensors.size(); ++i) {
    const RawRig::Sensor& sensor = rig.sensors[i];
    if (!sensor.is_camera || sensor.id != camera_id) continue;
    if (i == 0) return frame.rig_from_world;  // to the bit: it is the rig's frame of reference
    if (sensor.sensor_from_rig) return *sensor.sensor_from_rig * frame.rig_from_world;
    throw Error(
        fmt::format("{}: camera {} has no pose in rig {}; let COLMAP find it, or give a "
                    "model without rigs",
                    where, camera_id, rig.id));
  }
  throw Error(fmt::format("{}: expected a camera of rig {}, found {}", where, rig.id, camera_id));
}

// By image id.
std::map<std::uint64_t, PoseOfFrame> PosesOfFrames(const RawModel& raw) {
  const auto rigs = RigsById(raw);
  std::map<std::uint64_t, PoseOfFrame> poses;
  for (const RawFrame& frame : raw.frames) {
    const auto where = fmt::format("{}: frame {}", raw.frames_file.string(), frame.id);
    const auto rig = rigs.find(frame.rig_id);
    if (rig == rigs.end()) {
      throw Error(fmt::format("{}: expected a rig of {}, found the absent id {}", where,
                              raw.rigs_file.filename().string(), frame.rig_id));
    }
    for (const RawFrame::Data& data : frame.data) {
      if (!data.is_image) continue;
      const PoseOfFrame pose{frame.id, data.sensor_id,
                             CamFromWorld(frame, *rig->second, data.sensor_id, where)};
      if (!poses.emplace(data.id, pose).second) {
        throw Error(fmt::format("{}: image {} stands in another frame, too", where, data.id));
      }
    }
  }
  return poses;
}

// How far apart the two poses of an image are, and how large that is.
struct Difference {
  std::string name;
  double angle_rad = 0, distance = 0;
};

Difference Between(const calib::SfmImage& image, const Pose& of_frame) {
  return {image.name, image.cam_from_world.rotation.angularDistance(of_frame.rotation),
          (image.cam_from_world.TargetOriginInSource() - of_frame.TargetOriginInSource()).norm()};
}

// Half the diagonal of the box around the images' positions.
double Extent(const std::map<std::uint64_t, PoseOfFrame>& poses) {
  Eigen::AlignedBox3d box;
  for (const auto& [id, pose] : poses) box.extend(pose.cam_from_world.TargetOriginInSource());
  return box.isEmpty() ? 0 : box.diagonal().norm() / 2;
}

// Of images whose poses differ by more than printed digits; empty where none does.
std::string LineOf(const RawModel& raw, const std::vector<Difference>& all, double extent) {
  constexpr double kPrinted = 1e-5;  // radians, and share of the extent
  std::vector<Difference> other;
  std::copy_if(all.begin(), all.end(), std::back_inserter(other), [&](const Difference& d) {
    return d.angle_rad > kPrinted || d.distance > kPrinted * extent;
  });
  if (other.empty()) return "";
  double angle_rad = 0, distance = 0;
  for (const Difference& d : other) {
    angle_rad = std::max(angle_rad, d.angle_rad);
    distance = std::max(distance, d.distance);
  }
  return fmt::format(
      "{}: {} of {} images have another pose there than in {}, first {}, by up to {:.3g} degrees "
      "and {:.3g} units: those of {} are used, as COLMAP does",
      raw.frames_file.string(), other.size(), all.size(), raw.images_file.filename().string(),
      Printable(other.front().name), angle_rad * 180 / std::numbers::pi, distance,
      raw.frames_file.filename().string());
}

}  // namespace

std::string TakePosesOfFrames(RawModel& raw) {
  if (raw.frames.empty()) {
    if (raw.rigs.empty() || raw.images.empty()) return "";
    if (std::filesystem::exists(raw.frames_file)) {
      throw Error(
          fmt::format("{}: expected the frames of {} images, found none; the file is cut "
                      "short, or of another model",
                      raw.frames_file.string(), raw.images.size()));
    }
    return fmt::format("{}: is not used without {}: poses are those of {}", raw.rigs_file.string(),
                       raw.frames_file.filename().string(), raw.images_file.filename().string());
  }
  const auto poses = PosesOfFrames(raw);
  std::vector<Difference> differences;
  for (calib::SfmImage& image : raw.images) {
    const auto found = poses.find(image.id);
    if (found == poses.end() || found->second.camera_id != image.camera_id) {
      throw Error(fmt::format(
          "{}: image {} of {} is in none of its frames, with the same camera: they are of another "
          "model, or older; write the model again with COLMAP, or remove rigs and frames if {} has "
          "the right poses",
          raw.frames_file.string(), image.id, raw.images_file.filename().string(),
          raw.images_file.filename().string()));
    }
    differences.push_back(Between(image, found->second.cam_from_world));
    image.cam_from_world = found->second.cam_from_world;
  }
  return LineOf(raw, differences, Extent(poses));
}

}  // namespace dtr::colmap
