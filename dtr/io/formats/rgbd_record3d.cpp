// Record3D: https://github.com/marek-simonik/record3d. Its two exports say the same: "EXR + RGB"
// (metadata.json, rgb/N.jpg, depth/N.exr) and .r3d, a ZIP archive (metadata, rgbd/N.jpg, and
// rgbd/N.depth: LZFSE of floats, metres, row by row; rgbd/N.conf of LiDAR: LZFSE of bytes). Poses
// are (qx qy qz qw x y z), world_from_cam with ARKit's axes.
#include <fmt/format.h>

#include <charconv>
#include <optional>

#include "dtr/base/error.h"
#include "dtr/base/temporary_folder.h"
#include "dtr/base/text_file.h"
#include "dtr/io/formats/json_fields.h"
#include "dtr/io/formats/record3d_file.h"
#include "dtr/io/formats/rgbd_parts.h"

namespace dtr::io::internal {
namespace {

/// Where one of the exports has its parts.
struct Record3dLayout {
  const char *metadata, *photos, *depth, *depth_extension;
  const char* confidence_extension;  ///< beside the depth maps; null: it has none
};
constexpr Record3dLayout kExrExport = {"metadata.json", "rgb", "depth", ".exr", nullptr};
constexpr Record3dLayout kR3d = {"metadata", "rgbd", "rgbd", ".depth", ".conf"};

std::vector<double> Numbers(const Json& json, size_t count, const std::string& where) {
  if (!json.is_array() || json.size() != count) {
    throw Error(fmt::format("{}: expected a list of {} numbers, found another", where, count));
  }
  std::vector<double> numbers;
  for (const Json& number : json) numbers.push_back(NumberFrom(number, where));
  return numbers;
}

Eigen::Matrix3d KOfFrame(const Json& metadata, size_t frame, const std::string& where) {
  Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
  if (metadata.contains("perFrameIntrinsicCoeffs")) {
    const Json& all = metadata["perFrameIntrinsicCoeffs"];
    if (all.is_array() && frame < all.size()) {
      const auto own = Numbers(all[frame], 4, where + ": perFrameIntrinsicCoeffs");
      k(0, 0) = own[0], k(1, 1) = own[1], k(0, 2) = own[2], k(1, 2) = own[3];
      return k;
    }
  }
  // Column by column.
  const auto numbers = Numbers(Field(metadata, "K", where), 9, where + ": K");
  for (int i = 0; i < 9; ++i) k(i % 3, i / 3) = numbers[static_cast<size_t>(i)];
  return k;
}

/// The number that a file is called by; empty: it is none.
std::optional<size_t> NumberOf(const std::string& stem) {
  size_t number = 0;
  const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
  if (error != std::errc() || end != stem.data() + stem.size()) return std::nullopt;
  return number;
}

/// Photos that are there beyond the last pose.
void ListWithoutPose(size_t poses, RgbdCapture& capture) {
  for (const std::string& name : NamesIn(capture.images)) {
    const fs::path file = name;
    const auto number = NumberOf(file.stem().string());
    if (number && *number >= poses && PhotoCalled(capture.images, file.stem().string()) == name) {
      capture.skipped.emplace_back(name, "no pose");
    }
  }
}

/// `source`: what messages call the folder.
RgbdCapture ReadLayout(const Record3dLayout& layout, const fs::path& folder, const fs::path& images,
                       const fs::path& source) {
  const std::string where = (source / layout.metadata).string();
  const Json metadata = ParseJson(ReadTextFile(folder / layout.metadata, kMaxTextBytes), where);
  RgbdCapture capture;
  capture.images = images.empty() ? folder / layout.photos : images;
  capture.depth = folder / layout.depth;
  const int width = IntField(metadata, "w", 1, kMaxImageSidePx, where);
  const int height = IntField(metadata, "h", 1, kMaxImageSidePx, where);
  const Json& poses = Field(metadata, "poses", where);
  if (!poses.is_array()) throw Error(where + ": poses: expected a list, found something else");
  for (size_t frame = 0; frame < poses.size(); ++frame) {
    const std::string stem = std::to_string(frame), at = fmt::format("{}: frame {}", where, frame);
    const std::string photo_name = PhotoCalled(capture.images, stem);
    if (photo_name.empty()) {
      const fs::path photos = images.empty() ? source / layout.photos : images;
      capture.skipped.emplace_back(stem, "no photo in " + photos.string());
      continue;
    }
    const auto p = Numbers(poses[frame], 7, at + ": pose");
    Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
    pose.topLeftCorner<3, 3>() = Eigen::Quaterniond(p[3], p[0], p[1], p[2]).toRotationMatrix();
    pose.topRightCorner<3, 1>() = Eigen::Vector3d(p[4], p[5], p[6]);
    const SizedImage photo = SizedPhoto(capture.images, photo_name);
    const PinholeCamera full =
        CameraFromK(KOfFrame(metadata, frame, where), width, height, PixelOrigin::kCorner, where);
    AddFrame(photo, ScaledToImage(full, photo, at), PoseFromGl(pose, at),
             DepthCalled(capture.depth, stem, layout.depth_extension), capture);
  }
  ListWithoutPose(poses.size(), capture);
  if (layout.confidence_extension != nullptr) {
    TakeConfidence(capture.depth, layout.confidence_extension, capture);
  }
  return capture;
}

}  // namespace

bool IsUnpackedRecord3d(const fs::path& folder) {
  std::error_code ignored;
  return fs::is_regular_file(folder / kR3d.metadata, ignored) &&
         fs::is_directory(folder / kR3d.photos, ignored);
}

RgbdCapture ReadRecord3d(const fs::path& capture, const fs::path& images) {
  if (IsUnpackedRecord3d(capture)) return ReadLayout(kR3d, capture, images, capture);
  std::error_code ignored;
  if (fs::is_directory(capture, ignored)) return ReadLayout(kExrExport, capture, images, capture);
  const auto unpacked = std::make_shared<const TemporaryFolder>();
  // Messages about files in it then end in the recording's name and theirs.
  const fs::path folder = unpacked->path() / capture.filename();
  UnpackRecord3d(capture, folder);
  RgbdCapture read = ReadLayout(kR3d, folder, images, capture);
  read.unpacked = unpacked;
  return read;
}

}  // namespace dtr::io::internal
