// COLMAP's binary model files: little endian, no padding, counts as u64. The layouts stand in
// COLMAP's documentation, "Output Format".
#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <string_view>

#include "calib/colmap/raw_model.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr::colmap {
namespace {

static_assert(std::endian::native == std::endian::little, "the files are little endian");

// A cursor over a file's content that never reads past its end.
class BinaryReader {
 public:
  explicit BinaryReader(const std::filesystem::path& file)
      : file_(file.string()), content_(ReadFile(file, kLargestFile)), rest_(content_) {}

  template <typename T>
  T Take() {
    T value;
    if (rest_.size() < sizeof value) Truncated(sizeof value);
    std::memcpy(&value, rest_.data(), sizeof value);
    rest_.remove_prefix(sizeof value);
    return value;
  }

  // A count of records of at least `record_bytes` each: rejected when the file cannot hold them.
  size_t TakeCount(size_t record_bytes, const char* what) {
    const auto count = Take<std::uint64_t>();
    if (count > rest_.size() / record_bytes) {
      throw Error(fmt::format(
          "{}: byte {}: expected {} {}, found room for {}; the file is cut short", file_,
          content_.size() - rest_.size() - sizeof count, count, what, rest_.size() / record_bytes));
    }
    return static_cast<size_t>(count);
  }

  std::string TakeName() {
    const size_t end = rest_.find('\0');
    if (end == std::string_view::npos) Truncated(rest_.size() + 1);
    std::string name(rest_.substr(0, end));
    rest_.remove_prefix(end + 1);
    return name;
  }

  void ExpectEnd() const {
    if (!rest_.empty()) {
      throw Error(fmt::format("{}: expected the end after the last record, found {} bytes more",
                              file_, rest_.size()));
    }
  }

  const std::string& file() const { return file_; }

 private:
  [[noreturn]] void Truncated(size_t needed) const {
    throw Error(fmt::format("{}: byte {}: expected {} bytes more, found {}; the file is cut short",
                            file_, content_.size() - rest_.size(), needed, rest_.size()));
  }

  std::string file_;
  std::string content_;
  std::string_view rest_;
};

Pose TakePose(BinaryReader& in, const std::string& where) {
  double wxyz[4], translation[3];
  for (double& value : wxyz) value = in.Take<double>();
  for (double& value : translation) value = in.Take<double>();
  return CheckedPose(where, wxyz, translation);
}

// The type of a sensor: COLMAP knows cameras (0) and inertial units (1).
bool TakeIsCamera(BinaryReader& in, const std::string& where) {
  const auto type = in.Take<std::int32_t>();
  if (type == 0 || type == 1) return type == 0;
  throw Error(fmt::format("{}: expected a sensor of type 0 or 1, found {}", where, type));
}

void ReadRigs(RawModel& raw) {
  BinaryReader in(raw.rigs_file);
  raw.rigs.resize(in.TakeCount(4 + 4, "rigs"));
  for (RawRig& rig : raw.rigs) {
    rig.id = in.Take<std::uint32_t>();
    const auto where = fmt::format("{}: rig {}", in.file(), rig.id);
    const auto sensors = in.Take<std::uint32_t>();
    for (std::uint32_t i = 0; i < sensors; ++i) {
      RawRig::Sensor& sensor = rig.sensors.emplace_back();
      sensor.is_camera = TakeIsCamera(in, where);
      sensor.id = in.Take<std::uint32_t>();
      if (i == 0) {
        sensor.sensor_from_rig = Pose();
      } else if (in.Take<std::uint8_t>() != 0) {
        sensor.sensor_from_rig = TakePose(in, where);
      }
    }
  }
  in.ExpectEnd();
}

void ReadFrames(RawModel& raw) {
  BinaryReader in(raw.frames_file);
  raw.frames.resize(in.TakeCount(4 + 4 + 7 * 8 + 4, "frames"));
  for (RawFrame& frame : raw.frames) {
    frame.id = in.Take<std::uint32_t>();
    const auto where = fmt::format("{}: frame {}", in.file(), frame.id);
    frame.rig_id = in.Take<std::uint32_t>();
    frame.rig_from_world = TakePose(in, where);
    const auto data = in.Take<std::uint32_t>();
    for (std::uint32_t i = 0; i < data; ++i) {
      RawFrame::Data& of_sensor = frame.data.emplace_back();
      of_sensor.is_image = TakeIsCamera(in, where);
      of_sensor.sensor_id = in.Take<std::uint32_t>();
      of_sensor.id = in.Take<std::uint64_t>();
    }
  }
  in.ExpectEnd();
}

void ReadCameras(RawModel& raw) {
  BinaryReader in(raw.cameras_file);
  constexpr size_t kHeaderBytes = 4 + 4 + 8 + 8;
  const size_t count = in.TakeCount(kHeaderBytes, "cameras");
  raw.cameras.resize(count);
  for (auto& camera : raw.cameras) {
    camera.id = in.Take<std::uint32_t>();
    const auto where = fmt::format("{}: camera {}", in.file(), camera.id);
    const auto model_id = in.Take<std::int32_t>();
    const auto width_px = in.Take<std::uint64_t>();
    const auto height_px = in.Take<std::uint64_t>();
    std::vector<double> params(
        static_cast<size_t>(calib::ParameterCount(CheckedCameraModel(where, model_id))));
    for (double& value : params) value = in.Take<double>();
    camera.camera = CheckedCamera(where, model_id, width_px, height_px, std::move(params));
  }
  in.ExpectEnd();
}

void ReadImages(RawModel& raw) {
  BinaryReader in(raw.images_file);
  constexpr size_t kHeaderBytes = 4 + 7 * 8 + 4 + 1 + 8;
  constexpr size_t kFeatureBytes = 8 + 8 + 8;
  const size_t count = in.TakeCount(kHeaderBytes, "images");
  raw.images.resize(count);
  for (calib::SfmImage& image : raw.images) {
    image.id = in.Take<std::uint32_t>();
    const auto where = fmt::format("{}: image {}", in.file(), image.id);
    image.cam_from_world = TakePose(in, where);
    image.camera_id = in.Take<std::uint32_t>();
    image.name = in.TakeName();
    image.features.resize(in.TakeCount(kFeatureBytes, "features"));
    for (calib::SfmFeature& feature : image.features) {
      feature.pixel.x() = in.Take<double>();
      feature.pixel.y() = in.Take<double>();
      if (!feature.pixel.allFinite()) CheckedFinite(where, feature.pixel.sum());
      feature.point_id = in.Take<std::uint64_t>();
    }
  }
  in.ExpectEnd();
}

void ReadPoints(RawModel& raw) {
  BinaryReader in(raw.points_file);
  constexpr size_t kHeaderBytes = 8 + 3 * 8 + 3 + 8 + 8;
  constexpr size_t kElementBytes = 4 + 4;
  const size_t count = in.TakeCount(kHeaderBytes, "points");
  raw.points.resize(count);
  for (auto& point : raw.points) {
    point.id = in.Take<std::uint64_t>();
    for (int i = 0; i < 3; ++i) point.point.p_in_world[i] = in.Take<double>();
    for (auto& channel : point.point.rgb) channel = in.Take<std::uint8_t>();
    point.point.error_px = in.Take<double>();
    if (!point.point.p_in_world.allFinite() || !std::isfinite(point.point.error_px)) {
      CheckedFinite(fmt::format("{}: point {}", in.file(), point.id),
                    point.point.p_in_world.sum() + point.point.error_px);
    }
    point.track.resize(in.TakeCount(kElementBytes, "track elements"));
    for (RawTrackElement& element : point.track) {
      element.image_id = in.Take<std::uint32_t>();
      element.feature = in.Take<std::uint32_t>();
    }
  }
  in.ExpectEnd();
}

}  // namespace

RawModel ReadBinaryModel(const std::filesystem::path& folder) {
  RawModel raw;
  raw.cameras_file = folder / "cameras.bin";
  raw.images_file = folder / "images.bin";
  raw.points_file = folder / "points3D.bin";
  raw.rigs_file = folder / "rigs.bin";
  raw.frames_file = folder / "frames.bin";
  if (std::filesystem::exists(raw.rigs_file)) ReadRigs(raw);
  if (std::filesystem::exists(raw.frames_file)) ReadFrames(raw);
  ReadCameras(raw);
  ReadImages(raw);
  ReadPoints(raw);
  return raw;
}

}  // namespace dtr::colmap
