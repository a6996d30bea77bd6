// Cameras and points of other programs, rigs of other calibrations.
#include "calib/files/rig_files.h"
#include "dtr/base/files.h"
#include "dtr/base/temporary_folder.h"
#include "dtr/io/formats/file_look.h"
#include "dtr/io/formats/foreign_readers.h"
#include "tests/fuzz/readers.h"
#include "tests/pipeline/source_programs.h"

namespace dtr::fuzz {
namespace {

namespace fs = std::filesystem;
constexpr std::uintmax_t kSeedLimitBytes = 1 << 20;

using Read = io::ForeignScene (*)(const fs::path&);

// All variants of a format as seeds of one file; what lies beside the first lies beside it.
Reader OpenScene(const fs::path& folder, const std::string& format, Read read) {
  constexpr int kPoints = 2;
  const TemporaryFolder written;
  Reader reader;
  for (const auto& program : WriteAllPrograms(dtr::testing::TrueCapture(kPoints), written.path())) {
    if (program.format != format) continue;
    if (reader.seeds.empty()) reader.file = folder / program.file.filename();
    reader.seeds.push_back(ReadFile(program.file, kSeedLimitBytes));
    for (const auto& beside : fs::directory_iterator(program.file.parent_path())) {
      fs::copy(beside.path(), folder / beside.path().filename(),
               fs::copy_options::overwrite_existing);
    }
  }
  reader.read = [file = reader.file, read] {
    io::LookAt(file);
    read(file);
  };
  return reader;
}

Reader OpenMetashape(const fs::path& folder) {
  return OpenScene(folder, "metashape", io::ReadMetashapeXml);
}
Reader OpenRealityScan(const fs::path& folder) {
  return OpenScene(folder, "realityscan", io::ReadRealityScanCsv);
}
Reader OpenOpenSfm(const fs::path& folder) {
  return OpenScene(folder, "opensfm", io::ReadOpenSfmJson);
}
Reader OpenOpenMvg(const fs::path& folder) {
  return OpenScene(folder, "openmvg", io::ReadOpenMvgJson);
}
Reader OpenAliceVision(const fs::path& folder) {
  return OpenScene(folder, "alicevision", io::ReadAliceVisionJson);
}
Reader OpenBundler(const fs::path& folder) {
  return OpenScene(folder, "bundler", io::ReadBundlerOut);
}
Reader OpenNvm(const fs::path& folder) { return OpenScene(folder, "nvm", io::ReadNvm); }
Reader OpenMiv(const fs::path& folder) { return OpenScene(folder, "miv", io::ReadMivJson); }

Reader OpenTracks(const fs::path& folder) {
  Reader scene = OpenScene(folder, "opensfm", io::ReadOpenSfmJson);
  WriteFileAtomically(scene.file, scene.seeds.front());
  const fs::path tracks = folder / "tracks.csv";
  return {tracks, {ReadFile(tracks, kSeedLimitBytes)}, scene.read};
}

Reader OpenMvsnet(const fs::path& folder) {
  fs::create_directories(folder / "cams");
  const fs::path file = folder / "cams" / "00000000_cam.txt";
  return {file,
          {"extrinsic\n1 0 0 0.5\n0 1 0 0\n0 0 1 2\n0 0 0 1\n\nintrinsic\n50 0 20\n0 50 15\n0 0 "
           "1\n\n1.5 0.02 192 6\n"},
          [folder] { io::ReadMvsnetFolder(folder); }};
}

Reader OpenRigFiles(const fs::path& folder) {
  const fs::path file = folder / "rig.yaml";
  return {
      file,
      {"cam0:\n  camera_model: pinhole\n  distortion_coeffs: [0.1, 0, 0, 0]\n  distortion_model: "
       "radtan\n  intrinsics: [50, 50, 20, 15]\n  resolution: [40, 30]\ncam1:\n  T_cn_cnm1:\n  - "
       "[1, "
       "0, 0, 0.1]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n  camera_model: eucm\n  "
       "distortion_coeffs: []\n  distortion_model: none\n  intrinsics: [0.5, 1, 50, 50, 20, 15]\n  "
       "resolution: [40, 30]\n",
       "{ 'lensmodel': 'LENSMODEL_OPENCV4', # a comment\n 'intrinsics': [50, 50, 20, 15, 0.1, 0, "
       "0, "
       "0,],\n 'extrinsics': [0, 0, 0.1, 1, 2, 3,], 'imagersize': [40, 30,] }\n",
       "%YAML:1.0\n---\nM1: [50, 0, 20, 0, 50, 15, 0, 0, 1]\nD1: [0, 0, 0, 0]\nM2: [50, 0, 20, 0, "
       "50, 15, 0, 0, 1]\nD2: [0, 0, 0, 0]\nR: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nT: [1, 0, 0]\n"
       "image_width: 40\nimage_height: 30\n",
       "%YAML:1.0\nCamera.type: \"PinHole\"\nCamera.width: 40\nCamera.height: 30\nCamera1.fx: "
       "50\nCamera1.fy: 50\nCamera1.cx: 20\nCamera1.cy: 15\n"},
      [file] { calib::ReadCamerasOf(file); }};
}

constexpr ReaderKind kReaders[] = {
    {"metashape", OpenMetashape}, {"realityscan", OpenRealityScan},
    {"opensfm", OpenOpenSfm},     {"opensfm-tracks", OpenTracks},
    {"openmvg", OpenOpenMvg},     {"alicevision", OpenAliceVision},
    {"bundler", OpenBundler},     {"nvm", OpenNvm},
    {"mvsnet", OpenMvsnet},       {"miv", OpenMiv},
    {"rig-files", OpenRigFiles},
};

}  // namespace

std::span<const ReaderKind> SceneReaders() { return kReaders; }

}  // namespace dtr::fuzz
