#include "pipeline/core/cameras/camera_formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "calib/colmap/model_io.h"
#include "dtr/base/error.h"
#include "dtr/base/lower_case.h"
#include "dtr/base/text_file.h"
#include "dtr/base/text_rows.h"
#include "dtr/io/formats/foreign_readers.h"
#include "dtr/io/formats/plausible_intrinsics.h"
#include "dtr/io/formats/rgbd_capture.h"
#include "pipeline/core/camera_file.h"
#include "pipeline/core/photos/named_files.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using io::FileLook;

bool HoldsCams(const fs::path& folder) {
  std::error_code error;
  fs::directory_iterator entries(folder, error);
  for (; !error && entries != fs::directory_iterator(); entries.increment(error)) {
    if (entries->path().filename().string().ends_with("_cam.txt")) return true;
  }
  return false;
}

bool LooksMvsnet(const fs::path& file, const FileLook& look) {
  return look.is_folder && (HoldsCams(file / "cams") || HoldsCams(file));
}

bool LooksColmap(const fs::path& file, const FileLook& look) {
  if (!look.is_folder) return false;
  const fs::path model = colmap::ModelFolderIn(file);
  for (const char* part : {"cameras", "images", "points3D"}) {  // of one that is not whole, too
    const std::string name = part;
    if (IsFile(model / (name + ".bin")) || IsFile(model / (name + ".txt"))) return true;
  }
  return fs::is_directory(file / "sparse");  // with several models, of which none is meant
}

bool LooksLlff(const fs::path&, const FileLook& look) { return look.head.starts_with("\x93NUMPY"); }

bool LooksMetashape(const fs::path&, const FileLook& look) {
  return look.head.find("<document") != std::string::npos &&
         look.head.find("<chunk") != std::string::npos &&
         look.head.find("<sensors") != std::string::npos;
}

bool LooksBundler(const fs::path&, const FileLook& look) {
  return look.head.starts_with("# Bundle file");
}

bool LooksNvm(const fs::path&, const FileLook& look) { return look.head.starts_with("NVM_V3"); }

// A line that names columns, "#name,x,y,alt,..." or "#name,tx,ty,tz,R00,...".
bool LooksRealityScan(const fs::path& file, const FileLook& look) {
  TextRows rows(look.head, file.string());
  std::string_view line;
  while (rows.NextLine(line) && (line.empty() || line.starts_with("#cameras"))) continue;
  const std::vector<std::string> names = ColumnNames(line);
  const auto has = [&](const char* name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  return has("name") && (has("pitch") || has("r00"));
}

bool LooksOpenSfm(const fs::path&, const FileLook& look) {
  return look.is_json_list && look.Has("cameras") && look.Has("shots");
}

bool LooksOpenMvg(const fs::path&, const FileLook& look) {
  return look.is_json && look.Has("sfm_data_version");
}

bool LooksAliceVision(const fs::path&, const FileLook& look) {
  return look.is_json && look.Has("version") && look.Has("views") &&
         (look.Has("intrinsics") || look.Has("poses"));
}

bool LooksMiv(const fs::path&, const FileLook& look) {
  return look.is_json && !look.is_json_list && look.Has("cameras") &&
         (look.Has("BoundingBox_center") || look.Has("lengthsInMeters") || look.Has("Fps") ||
          look.Has("sourceCameraNames") || look.Has("Axial_system"));
}

bool LooksNerf(const fs::path&, const FileLook& look) {
  return look.is_json && look.Has("frames") && !look.Has("views");
}

bool LooksCamerasJson(const fs::path&, const FileLook& look) {
  return look.is_json && !look.is_json_list && look.Has("views") && !look.Has("intrinsics") &&
         !look.Has("board");
}

template <size_t kLayout>
bool LooksCapture(const fs::path& file, const FileLook&) {
  return io::RgbdFormatOf(file) == io::RgbdFormats()[kLayout];
}

constexpr CameraFormat kFormats[] = {
    {"colmap", "the folder of a COLMAP model", LooksColmap, nullptr},
    {"nerf", "a transforms.json (NeRF, instant-ngp, nerfstudio)", LooksNerf, nullptr},
    {"metashape", "Metashape's cameras as XML", LooksMetashape, io::ReadMetashapeXml},
    {"realityscan", "RealityScan's camera parameters as CSV", LooksRealityScan,
     io::ReadRealityScanCsv},
    {"opensfm", "OpenSfM's or ODM's reconstruction.json", LooksOpenSfm, io::ReadOpenSfmJson},
    {"openmvg", "OpenMVG's sfm_data.json", LooksOpenMvg, io::ReadOpenMvgJson},
    {"alicevision", "AliceVision's .sfm (JSON)", LooksAliceVision, io::ReadAliceVisionJson},
    {"bundler", "Bundler's bundle.out", LooksBundler, io::ReadBundlerOut},
    {"nvm", "VisualSFM's .nvm", LooksNvm, io::ReadNvm},
    {"llff", "a poses_bounds.npy (LLFF)", LooksLlff, nullptr},
    {"mvsnet", "a folder with MVSNet's cams", LooksMvsnet, io::ReadMvsnetFolder},
    {"miv", "the JSON of an MPEG immersive video sequence", LooksMiv, io::ReadMivJson},
    {"cameras-json", "a cameras.json", LooksCamerasJson, nullptr},
    // Captures, in the order of io::RgbdFormats().
    {"polycam", "a capture of Polycam", LooksCapture<0>, nullptr},
    {"record3d", "of Record3D", LooksCapture<1>, nullptr},
    {"stray-scanner", "of Stray Scanner", LooksCapture<2>, nullptr},
    {"3d-scanner-app", "of 3D Scanner App", LooksCapture<3>, nullptr},
    {"arkitscenes", "of ARKitScenes", LooksCapture<4>, nullptr},
    {"scannet", "of ScanNet", LooksCapture<5>, nullptr},
    {"tum", "a sequence of TUM RGB-D", LooksCapture<6>, nullptr},
    {"open3d", "of Open3D", LooksCapture<7>, nullptr},
    {"7scenes", "of 7-Scenes", LooksCapture<8>, nullptr},
};

// A row of numbers alone: a time and a pose (8, TUM's and EuRoC's), or a matrix (12, KITTI's).
bool LooksTrajectory(const fs::path& file, const FileLook& look) {
  TextRows rows(look.head, file.string());
  if (!rows.Next()) return false;
  const std::vector<std::string>& cells = rows.cells();
  const size_t least = 8;
  return cells.size() >= least && std::all_of(cells.begin(), cells.end(), [](const auto& cell) {
           return FiniteNumber(cell).has_value();
         });
}

// What a file is that gives no cameras of photos, as a clause; empty: not known.
std::string SeemsToBe(const fs::path& file, const FileLook& look) {
  const auto has = [&](const char* text) { return look.head.find(text) != std::string::npos; };
  const std::string extension = LowerExtension(file);
  if (look.is_folder) {
    return "the folder holds no cameras.bin, cameras.txt or cams; give the file in it that has the "
           "cameras";
  }
  if (extension == ".psx") {
    return "it is a Metashape project; export its cameras (File > Export > Export Cameras)";
  }
  if (extension == ".abc" || look.head.starts_with("Ogawa")) {
    return "it is an Alembic file; take cameras.sfm, or convert it to .sfm (ConvertSfMFormat)";
  }
  if (extension == ".rcproj" || extension == ".rsproj" || has("xcr:Rotation")) {
    return "it is of RealityScan; export its registration as \"Internal/External camera "
           "parameters\"";
  }
  if (has("lensmodel") || has("distortion_model") || has("opencv_storage") ||
      has("opencv-matrix") || has("camera_matrix") || look.Has("board")) {
    return "it describes the intrinsics of a camera and no photos; give it to `lens` or `rig`";
  }
  if (look.head.starts_with("ply\n")) return "it is a PLY file of points, not of cameras";
  if (look.head.starts_with("colmap 1.0\n")) {
    return "it is of Recon3D, from COLMAP; give COLMAP's model, or export it as NVM or Bundler";
  }
  if (look.head.starts_with("NVM_V")) return "only NVM_V3 is read; save it with VisualSFM 0.5";
  if (look.head.starts_with("CONTOUR\n")) {
    return "it is a projection matrix of PMVS; give the bundle.rd.out that it was made from";
  }
  if (LooksTrajectory(file, look)) {
    return "it is a trajectory, without intrinsics and the names of photos; make a TUM sequence of "
           "it (groundtruth.txt, rgb.txt, camera-intrinsics.txt)";
  }
  return "";
}

// Damaged files go by their names: their readers say what is wrong. Null: nobody's.
const CameraFormat* ByNameOf(const fs::path& file, const FileLook& look) {
  const std::string extension = LowerExtension(file);
  const auto called = [](const char* name) {
    return std::find_if(std::begin(kFormats), std::end(kFormats), [&](const CameraFormat& format) {
      return std::string(format.name) == name;
    });
  };
  if (extension == ".npy") return called("llff");
  if (extension != ".json" || (look.is_json && !look.is_broken)) return nullptr;
  return called(file.filename().string().starts_with("transforms") ? "nerf" : "cameras-json");
}

std::string Choices() {
  std::string list;
  for (const CameraFormat& format : kFormats) {
    list += (list.empty() ? "" : ", ") + fmt::format("{} ({})", format.program, format.name);
  }
  return list;
}

}  // namespace

std::span<const CameraFormat> CameraFormatTable() { return kFormats; }

std::vector<std::string> CameraFormats() {
  std::vector<std::string> names;
  for (const CameraFormat& format : kFormats) names.push_back(format.name);
  std::sort(names.begin(), names.end());
  return names;
}

CameraFormat FormatOf(const fs::path& file, const std::string& name, const std::string& what) {
  if (!fs::exists(file)) {
    throw UsageError(fmt::format("{} {}: no such file or folder", what, file.string()));
  }
  if (!name.empty()) {
    for (const CameraFormat& format : kFormats) {
      if (name == format.name) return format;
    }
    throw UsageError(fmt::format("`format` {}: expected one of {}", name, Choices()));
  }
  const FileLook look = io::LookAt(file);
  for (const CameraFormat& format : kFormats) {
    if (format.looks_so(file, look)) return format;
  }
  if (const CameraFormat* format = ByNameOf(file, look)) return *format;
  const std::string other = SeemsToBe(file, look);
  const std::string message =
      fmt::format("{} {}: not recognised{}{}; what can be read (its `format`): {}", what,
                  file.string(), other.empty() ? "" : ", ", other, Choices());
  // A folder may be the right one and lack its files; a file is another one than was meant.
  if (look.is_folder) throw Error(message);
  throw UsageError(message);
}

bool IsColmapModel(const fs::path& file, const std::string& name) {
  if (!name.empty()) return name == "colmap";
  return fs::is_directory(file) && LooksColmap(file, {.is_folder = true, .head = "", .keys = {}});
}

calib::SfmModel ReadGivenModel(const fs::path& folder, std::vector<std::string>* notes) {
  const fs::path model_folder = colmap::ModelFolderIn(folder);
  calib::SfmModel model = colmap::ReadModel(model_folder, notes);
  for (const auto& [id, camera] : model.cameras) {
    if (!calib::HasImages(model, id)) continue;
    const PinholeCamera pinhole = camera.Pinhole();
    io::RequirePlausibleFocal(pinhole.fx_px(), pinhole.fy_px(), camera.width_px, camera.height_px,
                              fmt::format("{}: camera {}", model_folder.string(), id));
  }
  return model;
}

bool HasSharedPoints(const calib::SfmModel& model) {
  std::map<std::uint64_t, const calib::SfmImage*> seen_by;
  for (const calib::SfmImage& image : model.images) {
    for (const calib::SfmFeature& feature : image.features) {
      if (!model.points.contains(feature.point_id)) continue;
      const auto [seen, is_first] = seen_by.emplace(feature.point_id, &image);
      if (!is_first && seen->second != &image) return true;
    }
  }
  return false;
}

std::string LineOfUnsharedPoints(const calib::SfmModel& model, const std::string& source) {
  if (model.points.empty() || HasSharedPoints(model)) return "";
  return fmt::format(
      "{}: none of its {} points is seen by two of the {} photos that are here, so none is used: "
      "others are triangulated from the photos",
      source, model.points.size(), model.images.size());
}

std::vector<fs::path> WithCompanions(const fs::path& file) {
  std::vector<fs::path> files = {file};
  if (file.empty()) return files;
  std::vector<fs::path> beside = io::BundlerLists(file);
  beside.push_back(file.parent_path() / "tracks.csv");
  for (const fs::path& other : beside) {
    if (IsFile(other)) files.push_back(other);
  }
  return files;
}

}  // namespace dtr::pipeline
