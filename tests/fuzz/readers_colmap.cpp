// COLMAP's files.
#include <sqlite3.h>

#include "calib/colmap/database.h"
#include "calib/colmap/dense.h"
#include "calib/colmap/model_io.h"
#include "dtr/base/files.h"
#include "tests/calib/colmap/model_test_support.h"
#include "tests/fuzz/readers.h"

namespace dtr::fuzz {
namespace {

namespace fs = std::filesystem;
constexpr std::uintmax_t kSeedLimitBytes = 1 << 20;

Reader OpenModel(const fs::path& folder, colmap::Format format, const std::string& part) {
  colmap::WriteModel(folder, colmap::testing::ModelWithEveryCamera(7), format);
  const fs::path file = folder / (part + (format == colmap::Format::kBinary ? ".bin" : ".txt"));
  return {file, {ReadFile(file, kSeedLimitBytes)}, [=] { colmap::ReadModel(folder); }};
}

Reader OpenCamerasBin(const fs::path& folder) {
  return OpenModel(folder, colmap::Format::kBinary, "cameras");
}
Reader OpenImagesBin(const fs::path& folder) {
  return OpenModel(folder, colmap::Format::kBinary, "images");
}
Reader OpenPointsBin(const fs::path& folder) {
  return OpenModel(folder, colmap::Format::kBinary, "points3D");
}
Reader OpenCamerasTxt(const fs::path& folder) {
  Reader reader = OpenModel(folder, colmap::Format::kText, "cameras");
  const fs::path file = reader.file;
  reader.read = [=] {
    colmap::ReadCamerasText(file);
    colmap::ReadModel(folder);
  };
  return reader;
}
Reader OpenImagesTxt(const fs::path& folder) {
  return OpenModel(folder, colmap::Format::kText, "images");
}
Reader OpenPointsTxt(const fs::path& folder) {
  return OpenModel(folder, colmap::Format::kText, "points3D");
}

Reader OpenRigs(const fs::path& folder, colmap::Format format, const std::string& part) {
  const bool binary = format == colmap::Format::kBinary;
  const calib::SfmModel model = colmap::testing::ModelWithEveryCamera(7);
  const auto files = colmap::testing::TrivialFrames(model, binary);
  const char* extension = binary ? ".bin" : ".txt";
  colmap::WriteModel(folder, model, format);
  WriteFileAtomically(folder / (std::string("rigs") + extension), files.rigs);
  WriteFileAtomically(folder / (std::string("frames") + extension), files.frames);
  const fs::path file = folder / (part + extension);
  return {file, {ReadFile(file, kSeedLimitBytes)}, [=] { colmap::ReadModel(folder); }};
}
Reader OpenRigsBin(const fs::path& folder) {
  return OpenRigs(folder, colmap::Format::kBinary, "rigs");
}
Reader OpenFramesBin(const fs::path& folder) {
  return OpenRigs(folder, colmap::Format::kBinary, "frames");
}
Reader OpenRigsTxt(const fs::path& folder) {
  return OpenRigs(folder, colmap::Format::kText, "rigs");
}
Reader OpenFramesTxt(const fs::path& folder) {
  return OpenRigs(folder, colmap::Format::kText, "frames");
}

Reader OpenDenseDepth(const fs::path& folder) {
  const fs::path file = folder / "a.jpg.geometric.bin";
  const std::vector<float> values{1, 2, 3, 0, 5, -1, 7, 8, 9, 10, 11, 12};
  std::string bytes = "4&3&1&";
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
  return {file, {bytes}, [=] { colmap::ReadDenseDepth(file, 4, 3); }};
}

Reader OpenDatabase(const fs::path& folder) {
  const fs::path file = folder / "database.db";
  sqlite3* database = nullptr;
  sqlite3_open(file.c_str(), &database);
  sqlite3_exec(database,
               "CREATE TABLE images (image_id INTEGER PRIMARY KEY, name TEXT, camera_id INTEGER);"
               "CREATE TABLE keypoints (image_id INTEGER PRIMARY KEY, rows INTEGER, cols INTEGER, "
               "data BLOB);"
               "CREATE TABLE two_view_geometries (pair_id INTEGER PRIMARY KEY, rows INTEGER, "
               "cols INTEGER, data BLOB, config INTEGER);"
               "INSERT INTO keypoints VALUES (1, 2, 2, zeroblob(16)), (2, 3, 4, zeroblob(48));"
               "INSERT INTO two_view_geometries VALUES (2147483649, 2, 2, zeroblob(16), 2);"
               "INSERT INTO images VALUES (1, 'a.jpg', 1), (2, 'b.jpg', 1);",
               nullptr, nullptr, nullptr);
  sqlite3_close(database);
  return {file, {ReadFile(file, kSeedLimitBytes)}, [=] {
            colmap::ReadDatabaseIds(file);
            colmap::ReadFeatureCounts(file);
            colmap::ForEachMatchedPair(file, [](const auto&) {});
          }};
}

constexpr ReaderKind kReaders[] = {
    {"colmap-cameras-bin", OpenCamerasBin}, {"colmap-images-bin", OpenImagesBin},
    {"colmap-points-bin", OpenPointsBin},   {"colmap-cameras-txt", OpenCamerasTxt},
    {"colmap-images-txt", OpenImagesTxt},   {"colmap-points-txt", OpenPointsTxt},
    {"colmap-rigs-bin", OpenRigsBin},       {"colmap-frames-bin", OpenFramesBin},
    {"colmap-rigs-txt", OpenRigsTxt},       {"colmap-frames-txt", OpenFramesTxt},
    {"colmap-depth", OpenDenseDepth},       {"colmap-database", OpenDatabase},
};

}  // namespace

std::span<const ReaderKind> ColmapReaders() { return kReaders; }

}  // namespace dtr::fuzz
