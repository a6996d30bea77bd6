// Cameras and float maps of other programs.
#include <bit>
#include <cstdint>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/formats/foreign_depth.h"
#include "dtr/io/formats/llff.h"
#include "dtr/io/formats/lzfse.h"
#include "dtr/io/formats/npy.h"
#include "dtr/io/formats/pfm.h"
#include "dtr/io/formats/rgbd_capture.h"
#include "dtr/io/formats/text_cameras.h"
#include "dtr/io/formats/transforms_json.h"
#include "dtr/io/image_io.h"
#include "tests/fuzz/readers.h"
#include "tests/support/zip_file.h"

namespace dtr::fuzz {
namespace {

namespace fs = std::filesystem;
constexpr std::uintmax_t kSeedLimitBytes = 1 << 20;

// numpy's format 1: magic, version, length of the header, the header padded to 64 bytes.
template <typename Number>
std::string Npy(const std::string& shape, const std::vector<Number>& values) {
  std::string header = std::string("{'descr': '<f") + std::to_string(sizeof(Number)) +
                       "', 'fortran_order': False, 'shape': " + shape + ", }";
  while ((10 + header.size() + 1) % 64 != 0) header += ' ';
  header += '\n';
  std::string bytes = "\x93NUMPY\x01";
  bytes += '\0';
  bytes += static_cast<char>(header.size() & 0xff);
  bytes += static_cast<char>(header.size() >> 8);
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Number));
  return bytes;
}

Reader OpenNpy(const fs::path& folder) {
  const fs::path file = folder / "array.npy";
  return {file,
          {Npy<double>("(2, 3)", {1, 2, 3, 4, 5, 6}), Npy<float>("(4,)", {1, 2, 3, 4}),
           Npy<double>("()", {7})},
          [=] {
            io::ReadNpy(file, {.half = true, .integers = true, .any_value = true});
            io::ReadNpy(file);
          }};
}

Reader OpenLlff(const fs::path& folder) {
  const fs::path file = folder / "poses_bounds.npy";
  // Axes [down, right, backwards], centre, [height, width, focal], near and far: two rows.
  std::vector<double> rows;
  for (const double x : {0.0, 0.5}) {
    for (const double value : {0., 1., 0., x, 30., -1., 0., 0., 0., 40., 0., 0., 1., 0., 50.}) {
      rows.push_back(value);
    }
    rows.push_back(1);
    rows.push_back(6);
  }
  return {file, {Npy("(2, 17)", rows)}, [=] {
            io::ReadLlff(file, {{"a.png", 40, 30}, {"b.png", 40, 30}});
          }};
}

Reader OpenPfm(const fs::path& folder) {
  const fs::path file = folder / "map.pfm";
  std::vector<std::string> seeds;
  for (const int channels : {1, 3}) {
    Grid<float> grid(5, 4, channels, 1.5f);
    io::WritePfm(file, grid, channels == 1);
    seeds.push_back(ReadFile(file, kSeedLimitBytes));
  }
  return {file, seeds, [=] {
            if (io::ReadPfm(file).channels() != 1) return;
            io::ReadForeignDepth(file, DepthKind::kPlaneZ, 1, 10, 8);
          }};
}

// NeRF's, time step-ngp's and nerfstudio's ways to say the same.
Reader OpenTransforms(const fs::path& folder) {
  const fs::path file = folder / "transforms.json";
  const std::string frames =
      R"("frames": [{"file_path": "./images/a", "depth_file_path": "depth/a.png",
  "transform_matrix": [[1,0,0,7],[0,0,-1,8],[0,1,0,9],[0,0,0,1]]}, {"file_path": "./images/b",
  "transform_matrix": [[1,0,0,7.5],[0,0,-1,8],[0,1,0,9],[0,0,0,1]]}]})";
  return {
      file,
      {R"({"w": 40, "h": 30, "fl_x": 50, "fl_y": 51, "cx": 21, "cy": 14, "k1": 0, )" + frames,
       R"({"camera_angle_x": 0.9, "aabb_scale": 4, )" + frames,
       R"({"w": 40, "h": 30, "fl_x": 50, "is_fisheye": 1, "k1": 0.1, "depth_unit_scale_factor": 0.01,
  "train_filenames": ["images/a"], "test_filenames": ["images/b"], )" +
           frames},
      [=] {
        io::TransformsPaths paths;
        paths.image_of = [](const std::string& path) {
          return io::SizedImage{path + ".png", 20, 15};
        };
        io::ReadTransformsJson(file, paths);
      }};
}

Reader OpenPar(const fs::path& folder) {
  const fs::path file = folder / "par.txt";
  return {file,
          {"2\na.png 50 0 20 0 50 15 0 0 1 1 0 0 0 1 0 0 0 1 0 0 0\n"
           "b.png 50 0 20 0 50 15 0 0 1 1 0 0 0 1 0 0 0 1 0.5 0 0\n"},
          [=] { io::ReadMiddleburyPar(file); }};
}

Reader OpenStrecha(const fs::path& folder) {
  const fs::path file = folder / "0000.png.camera";
  return {file, {"50 0 20\n0 50 15\n0 0 1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 2 3\n40 30\n"}, [=] {
            io::ReadStrechaCamera(file);
          }};
}

Reader OpenLog(const fs::path& folder) {
  const fs::path file = folder / "trajectory.log";
  return {
      file,
      {"0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 1 2\n1 0 0 0.5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"},
      [=] { io::ReadOpen3dLog(file); }};
}

Reader OpenMatrixText(const fs::path& folder) {
  const fs::path file = folder / "frame.pose.txt";
  return {file, {"1 0 0 0.5\n0 1 0 1\n0 0 1 2\n0 0 0 1\n", "585 0 320 0 585 240 0 0 1\n"}, [=] {
            try {
              io::ReadWorldFromCamText(file);
            } catch (const Error&) {
              io::ReadMatrix3Text(file);
            }
          }};
}

// A capture of a phone or depth camera, of which one file is bad.
Reader OpenCapture(const fs::path& folder, const std::string& format, const std::string& photo,
                   const std::string& file, std::vector<std::string> seeds,
                   const std::vector<std::pair<std::string, std::string>>& others) {
  fs::create_directories((folder / photo).parent_path());
  io::WriteImage(folder / photo, ImageRgb8(64, 48, 3, 90));
  for (const auto& [name, text] : others) {
    fs::create_directories((folder / name).parent_path());
    WriteFileAtomically(folder / name, text);
  }
  fs::create_directories((folder / file).parent_path());
  return {folder / file, std::move(seeds), [=] { io::ReadRgbdCapture(folder, format); },
          kImageBufferBytes};
}

constexpr char kPinhole[] = "50 0 32\n0 50 24\n0 0 1\n";

Reader OpenPolycam(const fs::path& folder) {
  return OpenCapture(
      folder, "polycam", "keyframes/images/1.png", "keyframes/cameras/1.json",
      {R"({"fx": 50, "fy": 50, "cx": 32, "cy": 24, "width": 64, "height": 48, "t_00": 1, "t_01": 0,
  "t_02": 0, "t_03": 0.5, "t_10": 0, "t_11": 1, "t_12": 0, "t_13": 1, "t_20": 0, "t_21": 0, "t_22": 1,
  "t_23": 2})"},
      {});
}
Reader OpenRecord3d(const fs::path& folder) {
  return OpenCapture(folder, "record3d", "rgb/0.png", "metadata.json",
                     {R"({"w": 64, "h": 48, "K": [50, 0, 0, 0, 50, 0, 32, 24, 1],
  "poses": [[0, 0, 0, 1, 1, 2, 3]], "perFrameIntrinsicCoeffs": [[50, 50, 32, 24]]})"},
                     {});
}
// A recording with a map of stored bytes, of LZVN, and of long runs.
Reader OpenR3d(const fs::path& folder) {
  const fs::path file = folder / "scan.r3d", photo = folder / "photo.jpg";
  io::WriteImage(photo, ImageRgb8(64, 48, 3, 90));
  const std::string metadata = R"({"w": 64, "h": 48, "K": [50, 0, 0, 0, 50, 0, 32, 24, 1],
  "poses": [[0, 0, 0, 1, 1, 2, 3]]})";
  const std::string depth = testing::StoredAsLzfse(std::string(4 * 16 * 12, '\x40'));
  testing::WriteZip(file, {{"metadata", metadata},
                           {"rgbd/0.jpg", ReadFile(photo, kSeedLimitBytes)},
                           {"rgbd/0.depth", depth}});
  return {file,
          {ReadFile(file, kSeedLimitBytes)},
          [=] { io::ReadRgbdCapture(file, "record3d"); },
          kImageBufferBytes};
}
// Streams of the reference encoder (tests/io/formats/lzfse_test.cpp), and stored bytes.
Reader OpenLzfseDepth(const fs::path& folder) {
  const fs::path file = folder / "0.depth";
  std::vector<std::string> seeds = {testing::StoredAsLzfse(std::string(4 * 36 * 48, '\x40'))};
  for (const char* name : {"depth", "depth_plain_header"}) {
    seeds.push_back(ReadFile(std::string(DTR_LZFSE_STREAMS) + name + ".lzfse", kSeedLimitBytes));
  }
  return {file, std::move(seeds),
          [=] { io::ReadDepthOfAnySize(file, DepthKind::kPlaneZ, 1, 72, 96); }};
}
Reader OpenConfidence(const fs::path& folder) {
  const fs::path file = folder / "0.conf";
  return {file, {ReadFile(std::string(DTR_LZFSE_STREAMS) + "conf.lzfse", kSeedLimitBytes)}, [=] {
            DepthImage depth(36, 48, DepthKind::kPlaneZ);
            io::LowConfidenceShare(file);
            io::LeaveOutLowConfidence(file, depth);
          }};
}
// LZVN stands for other things than depth.
Reader OpenLzfse(const fs::path& folder) {
  const fs::path file = folder / "stream";
  std::vector<std::string> seeds;
  for (const char* name : {"text", "conf", "runs", "short"}) {
    seeds.push_back(ReadFile(std::string(DTR_LZFSE_STREAMS) + name + ".lzfse", kSeedLimitBytes));
  }
  return {file, std::move(seeds), [=] {
            io::DecodeLzfse(ReadFile(file, kSeedLimitBytes), kSeedLimitBytes, file.string());
          }};
}
Reader OpenOdometry(const fs::path& folder) {
  return OpenCapture(
      folder, "stray-scanner", "rgb/000000.png", "odometry.csv",
      {"timestamp, frame, x, y, z, qx, qy, qz, qw\n0.5, 000000, 1, 2, 3, 0, 0, 0, 1\n"},
      {{"camera_matrix.csv", "50,0,32\n0,50,24\n0,0,1\n"}});
}
Reader OpenCameraMatrix(const fs::path& folder) {
  return OpenCapture(
      folder, "stray-scanner", "rgb/000000.png", "camera_matrix.csv", {"50,0,32\n0,50,24\n0,0,1\n"},
      {{"odometry.csv", "timestamp,frame,x,y,z,qx,qy,qz,qw\n0,000000,1,2,3,0,0,0,1\n"}});
}
Reader OpenTrajectory(const fs::path& folder) {
  return OpenCapture(folder, "arkitscenes", "lowres_wide/4_7.125.png", "lowres_wide.traj",
                     {"7.125 0.1 0.2 0.3 1 2 3\n7.225 0.1 0.2 0.3 1 2 3\n"},
                     {{"lowres_wide_intrinsics/4_7.125.pincam", "64 48 50 50 32 24"}});
}
Reader OpenPincam(const fs::path& folder) {
  return OpenCapture(folder, "arkitscenes", "lowres_wide/4_7.125.png",
                     "lowres_wide_intrinsics/4_7.125.pincam", {"64 48 50 50 32 24"},
                     {{"lowres_wide.traj", "7.125 0.1 0.2 0.3 1 2 3\n"}});
}
Reader OpenScanNet(const fs::path& folder) {
  const std::string matrix = "50 0 32 0\n0 50 24 0\n0 0 1 0\n0 0 0 1\n";
  return OpenCapture(folder, "scannet", "color/0.png", "pose/0.txt",
                     {"1 0 0 0.5\n0 1 0 1\n0 0 1 2\n0 0 0 1\n"},
                     {{"intrinsic/intrinsic_color.txt", matrix}});
}
Reader OpenTum(const fs::path& folder) {
  return OpenCapture(folder, "tum", "rgb/1.png", "groundtruth.txt",
                     {"# pose\n0.99 1 2 3 0 0 0 1\n1.01 1 2 3 0 0 0 1\n"},
                     {{"rgb.txt", "1 rgb/1.png\n"},
                      {"depth.txt", "1 rgb/1.png\n"},
                      {"camera-intrinsics.txt", kPinhole}});
}
Reader OpenTimes(const fs::path& folder) {
  return OpenCapture(folder, "tum", "rgb/1.png", "rgb.txt", {"# times\n1 rgb/1.png\n2 rgb/2.png\n"},
                     {{"groundtruth.txt", "0.99 1 2 3 0 0 0 1\n1.01 1 2 3 0 0 0 1\n"},
                      {"camera-intrinsics.txt", kPinhole}});
}
Reader OpenOpen3d(const fs::path& folder) {
  return OpenCapture(
      folder, "open3d", "color/00000.png", "camera_intrinsic.json",
      {R"({"width": 64, "height": 48, "intrinsic_matrix": [50, 0, 0, 0, 50, 0, 32, 24, 1]})"},
      {{"depth/note.txt", ""}, {"a.log", "0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"}});
}

constexpr ReaderKind kReaders[] = {
    {"npy", OpenNpy},
    {"llff", OpenLlff},
    {"pfm", OpenPfm},
    {"transforms", OpenTransforms},
    {"par", OpenPar},
    {"strecha", OpenStrecha},
    {"log", OpenLog},
    {"matrix-text", OpenMatrixText},
    {"polycam", OpenPolycam},
    {"record3d", OpenRecord3d},
    {"r3d", OpenR3d},
    {"lzfse-depth", OpenLzfseDepth},
    {"lzfse", OpenLzfse},
    {"confidence", OpenConfidence},
    {"odometry", OpenOdometry},
    {"camera-matrix", OpenCameraMatrix},
    {"trajectory", OpenTrajectory},
    {"pincam", OpenPincam},
    {"scannet", OpenScanNet},
    {"tum", OpenTum},
    {"times", OpenTimes},
    {"open3d", OpenOpen3d},
};

}  // namespace

std::span<const ReaderKind> CameraReaders() { return kReaders; }

}  // namespace dtr::fuzz
