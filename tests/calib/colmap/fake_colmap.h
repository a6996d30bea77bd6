// tests/calib/colmap/fake_colmap.h -- a `colmap` that does as it is told, first on the PATH.
#pragma once
#include <sqlite3.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "dtr/base/files.h"
#include "tests/support/test_data.h"

namespace dtr::colmap::testing {

/// Puts fake_colmap.sh, called colmap, first on the PATH for its life time. Told by files in its
/// folder: `fail.COMMAND` holds shell lines that the command runs first; `model.N` are the models
/// the mapper leaves; `database` is what the extractor leaves, `output` what the triangulator and
/// registrator leave (their input without it), `maps` what patch_match_stereo leaves; with a file
/// `cuda` it claims to have been built with CUDA. Every call is noted in `calls`.
class FakeColmap {
 public:
  /// `new_names`: with the option names of later versions.
  explicit FakeColmap(bool new_names = false) : old_path_(std::getenv("PATH")) {
    namespace fs = std::filesystem;
    fs::create_directories(folder_ / "bin");
    fs::copy_file(DTR_FAKE_COLMAP, folder_ / "bin" / "colmap");
    fs::permissions(folder_ / "bin" / "colmap", fs::perms::owner_all);
    WriteFileAtomically(folder_ / "options", Options(new_names));
    setenv("PATH", ((folder_ / "bin").string() + ":" + old_path_).c_str(), 1);
    setenv("FAKE_COLMAP", folder_.path().c_str(), 1);
  }
  ~FakeColmap() {
    setenv("PATH", old_path_.c_str(), 1);
    unsetenv("FAKE_COLMAP");
  }
  FakeColmap(const FakeColmap&) = delete;
  FakeColmap& operator=(const FakeColmap&) = delete;

  void Fail(const std::string& command, const std::string& shell_lines) {
    WriteFileAtomically(folder_ / ("fail." + command), shell_lines + "\n");
  }
  /// From now on it is a program that answers nothing.
  void Break() const { WriteFileAtomically(folder_ / "broken", ""); }
  /// Features that two images of a database have in common, a < b by their numbers from 0.
  struct Common {
    size_t a, b;
    int features;
    int config = 2;      ///< COLMAP's TwoViewGeometry::ConfigurationType; 2: calibrated
    bool still = false;  ///< at the same pixels in both
  };
  /// The database that the extractor leaves: these images, of the cameras named (else of one), with
  /// 100 features each, and of pairs what they have in common.
  void LeaveDatabase(const std::vector<std::string>& names, const std::vector<int>& cameras = {},
                     const std::vector<Common>& pairs = {}) const {
    std::filesystem::remove(folder_ / "database");
    sqlite3* database = nullptr;
    std::string sql =
        "CREATE TABLE images (image_id INTEGER, name TEXT, camera_id INTEGER);"
        "CREATE TABLE keypoints (image_id INTEGER, rows INTEGER, cols INTEGER, data BLOB);"
        "CREATE TABLE two_view_geometries (pair_id INTEGER, rows INTEGER, cols INTEGER, data BLOB, "
        "config INTEGER);";
    for (size_t i = 0; i < names.size(); ++i) {
      sql += "INSERT INTO images VALUES (" + std::to_string(i + 1) + ", '" + names[i] + "', " +
             std::to_string(cameras.empty() ? 1 : cameras.at(i)) + ");";
      sql += "INSERT INTO keypoints VALUES (" + std::to_string(i + 1) + ", 100, 2, x'" +
             Keypoints(i) + "');";
    }
    for (const Common& pair : pairs) {
      sql += "INSERT INTO two_view_geometries VALUES (" +
             std::to_string(2147483647 * (pair.a + 1) + pair.b + 1) + ", " +
             std::to_string(pair.features) + ", 2, x'" + Matches(pair) + "', " +
             std::to_string(pair.config) + ");";
    }
    const bool made = sqlite3_open((folder_ / "database").c_str(), &database) == SQLITE_OK &&
                      sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK;
    sqlite3_close(database);
    if (!made) throw std::runtime_error("no database for the fake colmap");
  }
  void Succeed(const std::string& command) {
    std::filesystem::remove(folder_ / ("fail." + command));
  }
  std::filesystem::path operator/(const std::string& name) const { return folder_ / name; }

  /// Calls so far that did work (not help), one line of arguments each.
  std::vector<std::string> Calls() const {
    std::vector<std::string> lines;
    if (!std::filesystem::exists(folder_ / "calls")) return lines;
    std::string text = ReadFile(folder_ / "calls", 1 << 20);
    for (size_t end; (end = text.find('\n')) != std::string::npos; text.erase(0, end + 1)) {
      lines.push_back(text.substr(0, end));
    }
    return lines;
  }
  void ForgetCalls() { std::filesystem::remove(folder_ / "calls"); }

 private:
  template <typename Number>
  static void AddHex(Number number, std::string& hex) {
    unsigned char bytes[sizeof(Number)];
    std::memcpy(bytes, &number, sizeof(Number));
    for (const unsigned char byte : bytes) {
      hex += "0123456789abcdef"[byte >> 4];
      hex += "0123456789abcdef"[byte & 15];
    }
  }
  // Features 0 to 49 lie at the same pixels in all images, the others move from image to image.
  static std::string Keypoints(size_t image) {
    std::string hex;
    for (int k = 0; k < 100; ++k) {
      AddHex(5.0f * static_cast<float>(k) + (k < 50 ? 0.0f : 20.0f * static_cast<float>(image)),
             hex);
      AddHex(2.0f * static_cast<float>(k), hex);
    }
    return hex;
  }
  // Feature k of both images; those that move, unless they are to stand still.
  static std::string Matches(const Common& pair) {
    std::string hex;
    for (int k = 0; k < pair.features; ++k) {
      const auto feature = static_cast<std::uint32_t>(pair.still ? k % 50 : 50 + k % 50);
      AddHex(feature, hex);
      AddHex(feature, hex);
    }
    return hex;
  }

  static std::string Options(bool new_names) {
    std::string options =
        "--database_path\n--image_path\n--image_list_path\n--match_list_path\n--match_type\n"
        "--input_path\n--output_path\n--ImageReader.camera_model\n--ImageReader.single_camera\n"
        "--SiftExtraction.max_num_features\n"
        "--ImageReader.camera_params\n--ImageReader.existing_camera_id\n--ImageReader.mask_path\n"
        "--ExhaustiveMatching.block_size\n--SequentialMatching.overlap\n"
        "--SequentialMatching.quadratic_overlap\n--Mapper.num_threads\n"
        "--Mapper.ba_refine_focal_length\n--Mapper.ba_refine_principal_point\n"
        "--Mapper.ba_refine_extra_params\n--Mapper.tri_ignore_two_view_tracks\n"
        "--Mapper.init_max_forward_motion\n--Mapper.init_min_tri_angle\n"
        "--Mapper.filter_min_tri_angle\n--Mapper.abs_pose_min_num_inliers\n";
    options += "--workspace_path\n--PatchMatchStereo.geom_consistency\n";
    options += new_names ? "--default_random_seed\n" : "--random_seed\n";
    for (const char* name : {".use_gpu", ".num_threads", ".max_image_size"}) {
      for (const char* stage : {"Extraction", "Matching"}) {
        options += std::string(new_names ? "--Feature" : "--Sift") + stage + name + "\n";
      }
    }
    return options;
  }

  dtr::testing::TemporaryFolder folder_;
  std::string old_path_;
};

}  // namespace dtr::colmap::testing
