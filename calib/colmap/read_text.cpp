// COLMAP's text model files. The layouts stand in COLMAP's documentation, "Output Format".
#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <string_view>

#include "calib/colmap/raw_model.h"
#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/base/text_file.h"

namespace dtr::colmap {
namespace {

constexpr std::string_view kBlanks = " \t\v\f";

std::string_view Trimmed(std::string_view text) {
  const size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

// The words of one line, as numbers; errors name file and line.
class Fields {
 public:
  Fields(std::string where, std::string_view line) : where_(std::move(where)), rest_(line) {}

  bool AtEnd() {
    rest_ = Trimmed(rest_);
    return rest_.empty();
  }

  std::string_view TakeWord(const char* what) {
    if (AtEnd())
      throw Error(fmt::format("{}: expected {}, found the end of the line", where_, what));
    const std::string_view word = rest_.substr(0, rest_.find_first_of(kBlanks));
    rest_.remove_prefix(word.size());
    return word;
  }

  template <typename T>
  T Take(const char* what) {
    const std::string_view word = TakeWord(what);
    if constexpr (std::is_floating_point_v<T>) {
      if (const auto number = FiniteNumber(word)) return *number;
    } else {
      T value{};
      const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), value);
      if (failure == std::errc() && end == word.data() + word.size()) return value;
    }
    throw Error(fmt::format("{}: expected {}, found '{}'{}", where_, what,
                            Printable(std::string(word)), DecimalCommaHint(word)));
  }

  std::string_view TakeRest() {
    const std::string_view rest = Trimmed(rest_);
    rest_ = {};
    return rest;
  }

  const std::string& where() const { return where_; }

 private:
  std::string where_;
  std::string_view rest_;
};

// Lines of a file, with the record count its comments announce.
class TextReader {
 public:
  explicit TextReader(const std::filesystem::path& file)
      : file_(file.string()), content_(ReadTextFile(file, kLargestFile)), rest_(content_) {}

  // The next line that carries a record, or nothing at the end of the file.
  std::optional<Fields> NextRecord() {
    while (const auto line = NextRawLine()) {
      const std::string_view text = Trimmed(*line);
      if (text.empty()) continue;
      if (text.front() != '#') {
        ++records_;
        return Fields(Where(), text);
      }
      NoteComment(text);
    }
    return std::nullopt;
  }

  // The line after a record, empty or not: at the end of the file an empty one may lack its end.
  Fields FollowingLine() { return Fields(Where(), NextRawLine().value_or("")); }

  void ExpectAnnouncedCount() const {
    if (announced_ && *announced_ != records_) {
      throw Error(
          fmt::format("{}: expected {} records, as its first lines say, found {}; the file "
                      "is cut short",
                      file_, *announced_, records_));
    }
  }

 private:
  std::string Where() const { return fmt::format("{}: line {}", file_, line_); }

  std::optional<std::string_view> NextRawLine() {
    if (rest_.empty()) return std::nullopt;
    const size_t end = rest_.find('\n');  // there is one: TextOf ends the last line, too
    const std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    ++line_;
    return line;
  }

  // "# Number of images: 11, mean observations per image: 3501.8"
  void NoteComment(std::string_view text) {
    constexpr std::string_view kCount = "# Number of ";
    if (!text.starts_with(kCount)) return;
    const size_t colon = text.find(": ");
    if (colon == std::string_view::npos) return;
    std::uint64_t count = 0;
    const char* first = text.data() + colon + 2;
    if (std::from_chars(first, text.data() + text.size(), count).ec == std::errc()) {
      announced_ = count;
    }
  }

  std::string file_;
  std::string content_;
  std::string_view rest_;
  size_t line_ = 0;
  std::uint64_t records_ = 0;
  std::optional<std::uint64_t> announced_;
};

std::uint64_t TakePointId(Fields& line) {
  const std::string_view word = line.TakeWord("a point id");
  if (word == "-1") return calib::SfmFeature::kNoPoint;
  std::uint64_t id = 0;
  const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), id);
  if (failure != std::errc() || end != word.data() + word.size()) {
    throw Error(fmt::format("{}: expected a point id, found '{}'", line.where(), word));
  }
  return id;
}

Pose TakePose(Fields& line) {
  double wxyz[4], translation[3];
  for (double& value : wxyz) value = line.Take<double>("a rotation (qw qx qy qz)");
  for (double& value : translation) value = line.Take<double>("a translation (tx ty tz)");
  return CheckedPose(line.where(), wxyz, translation);
}

bool TakeIsCamera(Fields& line) {
  const std::string_view type = line.TakeWord("a type of sensor");
  if (type == "CAMERA" || type == "IMU") return type == "CAMERA";
  throw Error(fmt::format("{}: expected a sensor CAMERA or IMU, found '{}'", line.where(),
                          Printable(std::string(type))));
}

void ExpectLineEnd(Fields& line) {
  if (line.AtEnd()) return;
  throw Error(fmt::format("{}: expected the end of the line, found '{}'", line.where(),
                          Printable(std::string(line.TakeRest()))));
}

void ReadRigsText(RawModel& raw) {
  TextReader in(raw.rigs_file);
  while (auto line = in.NextRecord()) {
    RawRig rig;
    rig.id = line->Take<std::uint32_t>("a rig id");
    const auto sensors = line->Take<std::uint32_t>("a number of sensors");
    for (std::uint32_t i = 0; i < sensors; ++i) {
      RawRig::Sensor& sensor = rig.sensors.emplace_back();
      sensor.is_camera = TakeIsCamera(*line);
      sensor.id = line->Take<std::uint32_t>("a sensor id");
      if (i == 0) {
        sensor.sensor_from_rig = Pose();
      } else if (line->Take<int>("1 where a pose follows, else 0") == 1) {
        sensor.sensor_from_rig = TakePose(*line);
      }
    }
    ExpectLineEnd(*line);
    raw.rigs.push_back(std::move(rig));
  }
  in.ExpectAnnouncedCount();
}

void ReadFramesText(RawModel& raw) {
  TextReader in(raw.frames_file);
  while (auto line = in.NextRecord()) {
    RawFrame frame;
    frame.id = line->Take<std::uint32_t>("a frame id");
    frame.rig_id = line->Take<std::uint32_t>("a rig id");
    frame.rig_from_world = TakePose(*line);
    const auto data = line->Take<std::uint32_t>("a number of images");
    for (std::uint32_t i = 0; i < data; ++i) {
      RawFrame::Data& of_sensor = frame.data.emplace_back();
      of_sensor.is_image = TakeIsCamera(*line);
      of_sensor.sensor_id = line->Take<std::uint32_t>("a sensor id");
      of_sensor.id = line->Take<std::uint64_t>("an image id");
    }
    ExpectLineEnd(*line);
    raw.frames.push_back(std::move(frame));
  }
  in.ExpectAnnouncedCount();
}

void ReadImagesText(RawModel& raw) {
  TextReader in(raw.images_file);
  while (auto line = in.NextRecord()) {
    calib::SfmImage image;
    image.id = line->Take<std::uint32_t>("an image id");
    image.cam_from_world = TakePose(*line);
    image.camera_id = line->Take<std::uint32_t>("a camera id");
    image.name = line->TakeRest();  // a name may contain spaces
    Fields features = in.FollowingLine();
    while (!features.AtEnd()) {
      calib::SfmFeature feature;
      feature.pixel.x() = features.Take<double>("x");
      feature.pixel.y() = features.Take<double>("y");
      feature.point_id = TakePointId(features);
      image.features.push_back(feature);
    }
    raw.images.push_back(std::move(image));
  }
  in.ExpectAnnouncedCount();
}

void ReadPointsText(RawModel& raw) {
  TextReader in(raw.points_file);
  while (auto line = in.NextRecord()) {
    RawModel::Point point;
    point.id = line->Take<std::uint64_t>("a point id");
    for (int i = 0; i < 3; ++i) point.point.p_in_world[i] = line->Take<double>("a coordinate");
    for (auto& channel : point.point.rgb) {
      const int value = line->Take<int>("a colour 0 to 255");
      if (value < 0 || value > 255) {
        throw Error(fmt::format("{}: expected a colour 0 to 255, found {}", line->where(), value));
      }
      channel = static_cast<std::uint8_t>(value);
    }
    point.point.error_px = line->Take<double>("an error");
    while (!line->AtEnd()) {
      const auto image_id = line->Take<std::uint32_t>("an image id");
      point.track.push_back({image_id, line->Take<std::uint32_t>("a feature index")});
    }
    raw.points.push_back(std::move(point));
  }
  in.ExpectAnnouncedCount();
}

}  // namespace

std::vector<RawModel::Camera> ReadTextCameras(const std::filesystem::path& file) {
  std::vector<RawModel::Camera> cameras;
  TextReader in(file);
  while (auto line = in.NextRecord()) {
    RawModel::Camera camera;
    camera.id = line->Take<std::uint32_t>("a camera id");
    const std::string name(line->TakeWord("a camera model"));
    const auto model = calib::CameraModelFromName(name);
    if (name == "EQUIRECTANGULAR") RejectEquirectangular(line->where());
    if (!model) {
      throw Error(
          fmt::format("{}: expected a camera model SIMPLE_PINHOLE to EUCM, found '{}'; undistort "
                      "the images first (colmap image_undistorter)",
                      line->where(), name));
    }
    const auto width_px = line->Take<std::uint64_t>("a width");
    const auto height_px = line->Take<std::uint64_t>("a height");
    std::vector<double> params;
    while (!line->AtEnd()) params.push_back(line->Take<double>("a camera parameter"));
    camera.camera = CheckedCamera(line->where(), static_cast<int>(*model), width_px, height_px,
                                  std::move(params));
    cameras.push_back(std::move(camera));
  }
  in.ExpectAnnouncedCount();
  return cameras;
}

RawModel ReadTextModel(const std::filesystem::path& folder) {
  RawModel raw;
  raw.cameras_file = folder / "cameras.txt";
  raw.images_file = folder / "images.txt";
  raw.points_file = folder / "points3D.txt";
  raw.rigs_file = folder / "rigs.txt";
  raw.frames_file = folder / "frames.txt";
  if (std::filesystem::exists(raw.rigs_file)) ReadRigsText(raw);
  if (std::filesystem::exists(raw.frames_file)) ReadFramesText(raw);
  raw.cameras = ReadTextCameras(raw.cameras_file);
  ReadImagesText(raw);
  ReadPointsText(raw);
  return raw;
}

}  // namespace dtr::colmap
