// dtr/io/formats/rgbd_parts.h -- what readers of RGB-D captures share. Internal to dtr/io/formats.
#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dtr/io/formats/rgbd_capture.h"
#include "dtr/io/formats/sized_image.h"
#include "dtr/io/formats/text_cameras.h"

namespace dtr::io::internal {

namespace fs = std::filesystem;

constexpr double kMillimetre = 0.001;
/// No list of poses or intrinsics is larger.
constexpr std::uintmax_t kMaxTextBytes = 64u << 20;

/// Names of the files of a folder, in byte order; empty where there is no folder.
std::vector<std::string> NamesIn(const fs::path& folder);
/// STEM.jpg, .jpeg or .png (or capitals) in a folder; empty: there is none.
std::string PhotoCalled(const fs::path& folder, const std::string& stem);
/// The depth map STEM and `extension` in a folder; empty: there is none.
std::string DepthCalled(const fs::path& folder, const std::string& stem, const char* extension);
/// Says that the capture has confidence maps where the folder exists.
void TakeConfidence(const fs::path& folder, const char* extension, RgbdCapture& capture);
/// The first of these folders that exists; throws Error naming them all.
fs::path FolderOf(const fs::path& capture, std::initializer_list<const char*> names);
SizedImage SizedPhoto(const fs::path& folder, const std::string& name);

/// NumbersText of a file: words between blanks, without comments.
std::string NumbersOfFile(const fs::path& file);
/// "inf" or "nan" in it: how programs write a pose that was lost.
bool HoldsNoNumber(std::string_view text);

/// From a unit quaternion and a position; axes of the camera as ours.
Pose PoseFrom(const Eigen::Quaterniond& world_from_cam, const Eigen::Vector3d& centre,
              const std::string& where);
/// From world_from_cam of OpenGL and ARKit: x right, y up, z back.
Pose PoseFromGl(const Eigen::Matrix4d& world_from_cam, const std::string& where);

/// The camera of a photo by intrinsics of an image of another size, which the file does not state:
/// the photo's own, or one of `sizes`, whichever has the principal point near its middle.
PinholeCamera CameraFor(const Eigen::Matrix3d& k, PixelOrigin origin, const SizedImage& photo,
                        const std::vector<std::pair<int, int>>& sizes, const std::string& where);

/// Adds a photo with its depth map, if that is there, and says how many are not.
void AddFrame(const SizedImage& photo, const PinholeCamera& camera, const Pose& cam_from_world,
              const std::string& depth_file, RgbdCapture& capture);

RgbdCapture ReadPolycam(const fs::path& folder, const fs::path& images);
/// Whether it has files frame_N.json and depth_N.png side by side, as 3D Scanner App exports them.
bool Is3dScannerApp(const fs::path& folder);
/// Whether it holds what a .r3d file does: `metadata` and rgbd/.
bool IsUnpackedRecord3d(const fs::path& folder);
RgbdCapture ReadRecord3d(const fs::path& folder, const fs::path& images);
RgbdCapture ReadStrayScanner(const fs::path& folder, const fs::path& images);
RgbdCapture Read3dScannerApp(const fs::path& folder, const fs::path& images);
RgbdCapture ReadArkitScenes(const fs::path& folder, const fs::path& images);
RgbdCapture ReadScanNet(const fs::path& folder, const fs::path& images);
RgbdCapture ReadTum(const fs::path& folder, const fs::path& images);
RgbdCapture ReadOpen3d(const fs::path& folder, const fs::path& images);
RgbdCapture Read7Scenes(const fs::path& folder, const fs::path& images);

}  // namespace dtr::io::internal
