// dtr/io/formats/rgbd_capture.h -- captures of phones and depth cameras, as their programs lay them
// out: photos, depth maps and poses in metres.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/foreign_confidence.h"

namespace dtr {
class TemporaryFolder;
}

namespace dtr::io {

/// A capture on disk.
struct RgbdCapture {
  CameraList list;                      ///< unit metre; depth files where there are any
  std::filesystem::path images, depth;  ///< folders that the list's names are relative to
  double depth_unit_m = 1;              ///< metres per number of a depth map; plane z
  ConfidenceMaps confidence;            ///< of the depth maps
  std::string confidence_line;          ///< what they leave out, one of `notes`; "": there are none
  std::vector<std::pair<std::string, std::string>> skipped;  ///< photos without a camera, and why
  std::vector<std::string> notes;                            ///< one line each
  /// Where an archive is unpacked: `images` and `depth` last no longer than it.
  std::shared_ptr<const TemporaryFolder> unpacked;
};

/// The layouts that are known:
///   polycam       keyframes/[corrected_]images, [corrected_]cameras/N.json, depth/N.png
///   record3d      metadata.json, rgb/N.jpg, depth/N.exr ("EXR + RGB"); a .r3d file, or what is in
///                 one: metadata, rgbd/N.jpg, rgbd/N.depth
///   stray-scanner camera_matrix.csv, odometry.csv, depth/N.png, rgb/N.jpg (frames of rgb.mp4)
///   3d-scanner-app frame_N.json, frame_N.jpg (of some), depth_N.png, conf_N.png ("All data")
///   arkitscenes   lowres_wide.traj, lowres_wide/, lowres_wide_intrinsics/, lowres_depth/
///   scannet       color/, depth/, pose/, intrinsic/ (of its export program)
///   tum           rgb.txt, depth.txt, groundtruth.txt
///   open3d        a .log trajectory, color/ (image/, rgb/), depth/ and an intrinsic .json
///   7scenes       frame-N.color.png, frame-N.depth.png, frame-N.pose.txt
std::vector<std::string> RgbdFormats();
bool IsRgbdFormat(const std::string& format);

/// Which of them a folder is, by the files it has; empty: none. A .r3d file is "record3d".
std::string RgbdFormatOf(const std::filesystem::path& capture);

/// Reads the cameras of a capture, of one of RgbdFormats(). Intrinsics that were written for
/// another size than the photo's are scaled. Photos without a pose, and poses without a photo, are
/// left out and listed. `images`: where the photos are instead of in the layout's folder; empty:
/// there. Throws Error, naming the file, where one is missing, cut short or damaged, where no photo
/// has a pose, and where the depth maps are of another camera than the photos' (not registered to
/// them).
RgbdCapture ReadRgbdCapture(const std::filesystem::path& capture, const std::string& format,
                            const std::filesystem::path& images = {});

}  // namespace dtr::io
