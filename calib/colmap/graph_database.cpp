#include "calib/colmap/graph_database.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "calib/colmap/database.h"
#include "calib/colmap/sqlite_file.h"
#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"

namespace dtr::colmap {
namespace fs = std::filesystem;
namespace {

static_assert(std::endian::native == std::endian::little, "COLMAP's blobs are little-endian");

// PRAGMA user_version of COLMAP 3.8, by which later versions know what to add.
constexpr char kLayout[] = R"(
PRAGMA user_version = 3800;
CREATE TABLE cameras (camera_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
  model INTEGER NOT NULL, width INTEGER NOT NULL, height INTEGER NOT NULL, params BLOB,
  prior_focal_length INTEGER NOT NULL);
CREATE TABLE images (image_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
  name TEXT NOT NULL UNIQUE, camera_id INTEGER NOT NULL,
  prior_qw REAL, prior_qx REAL, prior_qy REAL, prior_qz REAL,
  prior_tx REAL, prior_ty REAL, prior_tz REAL,
  CONSTRAINT image_id_check CHECK(image_id >= 0 and image_id < 2147483647),
  FOREIGN KEY(camera_id) REFERENCES cameras(camera_id));
CREATE UNIQUE INDEX index_name ON images(name);
CREATE TABLE keypoints (image_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL,
  cols INTEGER NOT NULL, data BLOB,
  FOREIGN KEY(image_id) REFERENCES images(image_id) ON DELETE CASCADE);
CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL,
  cols INTEGER NOT NULL, data BLOB,
  FOREIGN KEY(image_id) REFERENCES images(image_id) ON DELETE CASCADE);
CREATE TABLE matches (pair_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL,
  cols INTEGER NOT NULL, data BLOB);
CREATE TABLE two_view_geometries (pair_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER NOT NULL,
  cols INTEGER NOT NULL, data BLOB, config INTEGER NOT NULL, F BLOB, E BLOB, H BLOB,
  qvec BLOB, tvec BLOB);
)";

constexpr int kKeypointColumns = 4;  // x, y, scale, orientation
constexpr int kDescriptorColumns = 128;

// A database that is written, all of it or nothing: what Commit() did not confirm is undone.
class Transaction {
 public:
  explicit Transaction(const fs::path& file) : file_(file) {
    sqlite3* opened = nullptr;
    const int failure = sqlite3_open(file.c_str(), &opened);
    handle_.reset(opened);
    if (failure != SQLITE_OK) Fail(sqlite3_errstr(failure));
    Execute("BEGIN");
  }

  void Execute(const char* commands) {
    if (sqlite3_exec(handle_.get(), commands, nullptr, nullptr, nullptr) != SQLITE_OK) {
      Fail(sqlite3_errmsg(handle_.get()));
    }
  }

  void Commit() { Execute("COMMIT"); }

  /// One statement with its parameters, to be run again and again.
  class Statement {
   public:
    Statement(Transaction& transaction, const char* command) : transaction_(transaction) {
      sqlite3_stmt* prepared = nullptr;
      if (sqlite3_prepare_v2(transaction.handle_.get(), command, -1, &prepared, nullptr) !=
          SQLITE_OK) {
        transaction.Fail(sqlite3_errmsg(transaction.handle_.get()));
      }
      statement_.reset(prepared);
    }
    Statement& Integer(sqlite3_int64 value) {
      sqlite3_bind_int64(statement_.get(), ++bound_, value);
      return *this;
    }
    Statement& Text(const std::string& text) {
      sqlite3_bind_text(statement_.get(), ++bound_, text.c_str(), -1, SQLITE_TRANSIENT);
      return *this;
    }
    /// `numbers` must live until Run() is done.
    template <typename Number>
    Statement& Blob(std::span<const Number> numbers) {
      // An empty span may have no address, and SQLite takes that for NULL.
      sqlite3_bind_blob64(statement_.get(), ++bound_,
                          numbers.empty() ? static_cast<const void*>("") : numbers.data(),
                          numbers.size_bytes(), SQLITE_STATIC);
      return *this;
    }
    void Run() {
      const int step = sqlite3_step(statement_.get());
      if (step != SQLITE_DONE) {
        transaction_.Fail(sqlite3_errmsg(transaction_.handle_.get()));
      }
      sqlite3_reset(statement_.get());
      bound_ = 0;
    }

   private:
    Transaction& transaction_;
    std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)> statement_{nullptr,
                                                                          &sqlite3_finalize};
    int bound_ = 0;
  };

 private:
  [[noreturn]] void Fail(const std::string& why) const {
    throw Error(file_.string() + ": cannot be written: " + why);
  }

  fs::path file_;
  std::unique_ptr<sqlite3, decltype(&sqlite3_close)> handle_{nullptr, &sqlite3_close};
};

using Statement = Transaction::Statement;

void InsertCameras(Transaction& transaction, std::span<const calib::LensCamera> cameras,
                   const std::vector<bool>& focal_is_known) {
  Statement insert(transaction, "INSERT OR REPLACE INTO cameras VALUES (?, ?, ?, ?, ?, ?)");
  for (size_t i = 0; i < cameras.size(); ++i) {
    insert.Integer(static_cast<sqlite3_int64>(i + 1))
        .Integer(static_cast<int>(cameras[i].model))
        .Integer(cameras[i].width_px)
        .Integer(cameras[i].height_px)
        .Blob(std::span<const double>(cameras[i].params))
        .Integer(focal_is_known[i] ? 1 : 0)
        .Run();
  }
}

// TwoViewGeometry::ConfigurationType.
enum Configuration { kCalibrated = 2, kUncalibrated = 3, kPlanar = 4, kPanoramic = 5 };

Configuration ConfigurationOf(sfm::PairKind kind) {
  switch (kind) {
    case sfm::PairKind::kCalibrated:
      return kCalibrated;
    case sfm::PairKind::kPlanar:
      return kPlanar;
    case sfm::PairKind::kRotation:
      return kPanoramic;
    case sfm::PairKind::kUncalibrated:
      break;
  }
  return kUncalibrated;
}

sfm::PairKind KindOf(const fs::path& database, int configuration) {
  switch (configuration) {
    case kCalibrated:
      return sfm::PairKind::kCalibrated;
    case kUncalibrated:
      return sfm::PairKind::kUncalibrated;
    case kPlanar:
      return sfm::PairKind::kPlanar;
    case kPanoramic:
      return sfm::PairKind::kRotation;
    default:
      RejectDatabase(database, "a pair of kind " + std::to_string(configuration));
  }
}

using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

RowMajor3 EssentialOf(const sfm::PairGeometry& pair) {
  const Eigen::Vector3d& t = pair.b_translation_a;
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  return cross * pair.b_rotation_a;
}

template <typename Number, size_t kCount>
std::array<Number, kCount> Numbers(const fs::path& database, sqlite3_stmt* row, int column) {
  std::array<Number, kCount> numbers{};
  const void* data = sqlite3_column_blob(row, column);
  if (data == nullptr || sqlite3_column_bytes(row, column) != sizeof numbers) {
    RejectDatabase(database, "a pair without the rotation of its cameras");
  }
  std::memcpy(numbers.data(), data, sizeof numbers);
  for (const Number number : numbers) {
    if (!std::isfinite(number)) RejectDatabase(database, "a number that is not finite");
  }
  return numbers;
}

void ReadCameras(const ReadOnlyDatabase& opened, const fs::path& database, sfm::ViewGraph& graph) {
  opened.ForEachRow(
      "SELECT model, width, height, params, prior_focal_length FROM cameras ORDER BY camera_id",
      [&](sqlite3_stmt* row) {
        calib::LensCamera& camera = graph.cameras.emplace_back();
        camera.model = static_cast<calib::CameraModel>(sqlite3_column_int(row, 0));
        camera.width_px = sqlite3_column_int(row, 1);
        camera.height_px = sqlite3_column_int(row, 2);
        const auto bytes = static_cast<size_t>(sqlite3_column_bytes(row, 3));
        constexpr size_t kMaxParams = calib::kMaxCameraParameters;
        const int model = sqlite3_column_int(row, 0);
        if (!calib::CameraModelFromId(model) || bytes % sizeof(double) != 0 ||
            bytes > kMaxParams * sizeof(double)) {
          RejectDatabase(database, "a camera of the model " + std::to_string(model) + " with " +
                                       std::to_string(bytes) + " bytes of parameters");
        }
        camera.params.resize(bytes / sizeof(double));
        if (bytes > 0) std::memcpy(camera.params.data(), sqlite3_column_blob(row, 3), bytes);
        try {
          camera.Check();
        } catch (const std::invalid_argument& wrong) {
          RejectDatabase(database, wrong.what());
        }
        graph.focal_is_known.push_back(sqlite3_column_int(row, 4) != 0);
      });
}

// Images in the order of ids; `index_of`: of an id.
void ReadImages(const ReadOnlyDatabase& opened, const fs::path& database, sfm::ViewGraph& graph,
                std::map<std::uint32_t, int>& index_of) {
  opened.ForEachRow(
      "SELECT image_id, name, camera_id FROM images ORDER BY image_id", [&](sqlite3_stmt* row) {
        const auto* name = reinterpret_cast<const char*>(sqlite3_column_text(row, 1));
        if (name == nullptr) RejectDatabase(database, "an image without a name");
        const std::uint32_t camera = opened.Id(sqlite3_column_int64(row, 2));
        if (camera > graph.cameras.size()) RejectDatabase(database, "an image without a camera");
        index_of[opened.Id(sqlite3_column_int64(row, 0))] = static_cast<int>(graph.images.size());
        graph.images.push_back({name, static_cast<int>(camera - 1), {}});
      });
  opened.ForEachRow("SELECT image_id, rows, cols, data FROM keypoints", [&](sqlite3_stmt* row) {
    const auto found = index_of.find(opened.Id(sqlite3_column_int64(row, 0)));
    if (found == index_of.end()) RejectDatabase(database, "features of no image");
    const auto values = opened.Matrix<float>(row, 1, 2);
    auto& pixels = graph.images[static_cast<size_t>(found->second)].pixels;
    for (size_t i = 0; i < values.rows; ++i) {
      pixels.emplace_back(values.At(i, 0), values.At(i, 1));
      if (!pixels.back().allFinite()) RejectDatabase(database, "a feature that lies nowhere");
    }
  });
}

// Median angle between the rays of the pair's matches. Pixels without a ray do not count.
double ParallaxOf(const sfm::ViewGraph& graph, const sfm::PairGeometry& pair) {
  const sfm::GraphImage& a = graph.images[static_cast<size_t>(pair.image_a)];
  const sfm::GraphImage& b = graph.images[static_cast<size_t>(pair.image_b)];
  const calib::LensCamera& lens_a = graph.cameras[static_cast<size_t>(a.camera)];
  const calib::LensCamera& lens_b = graph.cameras[static_cast<size_t>(b.camera)];
  std::vector<double> angles;
  for (const auto& [in_a, in_b] : pair.matches) {
    const auto ray_a = lens_a.RayFromPixel(a.pixels[in_a]);
    const auto ray_b = lens_b.RayFromPixel(b.pixels[in_b]);
    if (!ray_a || !ray_b) continue;
    const Eigen::Vector3d turned = pair.b_rotation_a * *ray_a;
    angles.push_back(std::atan2(turned.cross(*ray_b).norm(), turned.dot(*ray_b)));
  }
  return angles.empty() ? 0 : UpperMedian(angles);
}

}  // namespace

void CreateGraphDatabase(const fs::path& database, std::span<const calib::LensCamera> cameras,
                         const std::vector<bool>& focal_is_known,
                         std::span<const DatabaseImage> images) {
  RemoveDatabase(database);
  Transaction transaction(database);
  transaction.Execute(kLayout);
  InsertCameras(transaction, cameras, focal_is_known);
  Statement insert(transaction, "INSERT INTO images (image_id, name, camera_id) VALUES (?, ?, ?)");
  for (size_t i = 0; i < images.size(); ++i) {
    insert.Integer(static_cast<sqlite3_int64>(i + 1))
        .Text(images[i].name)
        .Integer(images[i].camera + 1)
        .Run();
  }
  transaction.Commit();
}

void AddFeatures(const fs::path& database, std::span<const size_t> images,
                 std::span<const sfm::Features> features) {
  Transaction transaction(database);
  Statement keypoints(transaction, "INSERT OR REPLACE INTO keypoints VALUES (?, ?, ?, ?)");
  Statement descriptors(transaction, "INSERT OR REPLACE INTO descriptors VALUES (?, ?, ?, ?)");
  for (size_t i = 0; i < images.size(); ++i) {
    const sfm::Features& of_image = features[i];
    const auto id = static_cast<sqlite3_int64>(images[i] + 1);
    const auto count = static_cast<sqlite3_int64>(of_image.keypoints.size());
    static_assert(sizeof(sfm::Keypoint) == kKeypointColumns * sizeof(float));
    static_assert(sizeof(sfm::Descriptor) == kDescriptorColumns);
    keypoints.Integer(id)
        .Integer(count)
        .Integer(kKeypointColumns)
        .Blob(std::span<const sfm::Keypoint>(of_image.keypoints))
        .Run();
    descriptors.Integer(id)
        .Integer(count)
        .Integer(kDescriptorColumns)
        .Blob(std::span<const sfm::Descriptor>(of_image.descriptors))
        .Run();
  }
  transaction.Commit();
}

std::vector<sfm::Keypoint> ReadKeypoints(const fs::path& database, std::uint32_t image_id) {
  const ReadOnlyDatabase opened(database);
  std::vector<sfm::Keypoint> keypoints;
  int records = 0;
  const std::string query =
      "SELECT rows, cols, data FROM keypoints WHERE image_id = " + std::to_string(image_id);
  opened.ForEachRow(query.c_str(), [&](sqlite3_stmt* row) {
    const auto values = opened.Matrix<float>(row, 0, kKeypointColumns);
    ++records;
    for (size_t i = 0; i < values.rows; ++i) {
      const sfm::Keypoint keypoint{values.At(i, 0), values.At(i, 1), values.At(i, 2),
                                   values.At(i, 3)};
      if (!std::isfinite(keypoint.x_px) || !std::isfinite(keypoint.y_px) ||
          !std::isfinite(keypoint.scale_px) || !std::isfinite(keypoint.orientation_rad)) {
        RejectDatabase(database, "a feature that is not finite");
      }
      keypoints.push_back(keypoint);
    }
  });
  if (records == 0) RejectDatabase(database, "no features of image " + std::to_string(image_id));
  return keypoints;
}

std::vector<sfm::Descriptor> ReadDescriptors(const fs::path& database, std::uint32_t image_id,
                                             size_t keypoints, size_t first) {
  const ReadOnlyDatabase opened(database);
  std::vector<sfm::Descriptor> descriptors;
  size_t found = 0;
  const std::string query =
      "SELECT rows, cols, data FROM descriptors WHERE image_id = " + std::to_string(image_id);
  opened.ForEachRow(query.c_str(), [&](sqlite3_stmt* row) {
    const auto values = opened.Matrix<std::uint8_t>(row, 0, kDescriptorColumns);
    if (values.rows > 0 && values.cols != kDescriptorColumns) {
      RejectDatabase(database, "descriptors of " + std::to_string(values.cols) + " numbers");
    }
    found = values.rows;
    descriptors.resize(std::min(first, values.rows));
    if (!descriptors.empty()) {
      std::memcpy(descriptors.data(), values.data, descriptors.size() * kDescriptorColumns);
    }
  });
  if (found != keypoints) {
    RejectDatabase(database, std::to_string(keypoints) + " features with " + std::to_string(found) +
                                 " descriptors");
  }
  return descriptors;
}

sfm::Features ReadFeatures(const fs::path& database, std::uint32_t image_id) {
  sfm::Features features;
  features.keypoints = ReadKeypoints(database, image_id);
  const size_t count = features.keypoints.size();
  features.descriptors = ReadDescriptors(database, image_id, count, count);
  return features;
}

void WriteViewGraph(const fs::path& database, const sfm::ViewGraph& graph) {
  Transaction transaction(database);
  transaction.Execute("DELETE FROM matches; DELETE FROM two_view_geometries");
  InsertCameras(transaction, graph.cameras, graph.focal_is_known);
  Statement matches(transaction, "INSERT INTO matches VALUES (?, ?, ?, ?)");
  Statement verified(transaction,
                     "INSERT INTO two_view_geometries VALUES (?, ?, ?, ?, ?, NULL, ?, NULL, ?, ?)");
  for (const sfm::PairGeometry& pair : graph.pairs) {
    const sqlite3_int64 id = kPairBase * (pair.image_a + 1) + pair.image_b + 1;
    const auto count = static_cast<sqlite3_int64>(pair.matches.size());
    static_assert(sizeof(sfm::FeatureMatches::value_type) == 2 * sizeof(std::uint32_t));
    const std::span<const sfm::FeatureMatches::value_type> rows(pair.matches);
    matches.Integer(id).Integer(count).Integer(2).Blob(rows).Run();
    const RowMajor3 essential = EssentialOf(pair);
    const Eigen::Quaterniond q(pair.b_rotation_a);
    const std::array<double, 4> wxyz{q.w(), q.x(), q.y(), q.z()};
    verified.Integer(id)
        .Integer(count)
        .Integer(2)
        .Blob(rows)
        .Integer(ConfigurationOf(pair.kind))
        .Blob(std::span<const double>(essential.data(), 9))
        .Blob(std::span<const double>(wxyz))
        .Blob(std::span<const double>(pair.b_translation_a.data(), 3))
        .Run();
  }
  transaction.Commit();
}

sfm::ViewGraph ReadViewGraph(const fs::path& database) {
  const ReadOnlyDatabase opened(database);
  sfm::ViewGraph graph;
  std::map<std::uint32_t, int> index_of;
  ReadCameras(opened, database, graph);
  ReadImages(opened, database, graph, index_of);
  opened.ForEachRow(
      "SELECT pair_id, rows, cols, data, config, qvec, tvec FROM two_view_geometries "
      "WHERE rows > 0 ORDER BY pair_id",
      [&](sqlite3_stmt* row) {
        sfm::PairGeometry& pair = graph.pairs.emplace_back();
        const sqlite3_int64 id = sqlite3_column_int64(row, 0);
        const auto a = index_of.find(opened.Id(id / kPairBase)),
                   b = index_of.find(opened.Id(id % kPairBase));
        if (a == index_of.end() || b == index_of.end() || a->second >= b->second) {
          RejectDatabase(database, "a pair of images that it lacks");
        }
        pair.image_a = a->second;
        pair.image_b = b->second;
        pair.kind = KindOf(database, sqlite3_column_int(row, 4));
        const auto wxyz = Numbers<double, 4>(database, row, 5);
        const auto t = Numbers<double, 3>(database, row, 6);
        pair.b_rotation_a =
            Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized().toRotationMatrix();
        pair.b_translation_a = {t[0], t[1], t[2]};
        const auto matches = opened.Matrix<std::uint32_t>(row, 1, 2);
        const auto& in_a = graph.images[static_cast<size_t>(pair.image_a)].pixels;
        const auto& in_b = graph.images[static_cast<size_t>(pair.image_b)].pixels;
        for (size_t i = 0; i < matches.rows; ++i) {
          pair.matches.emplace_back(matches.At(i, 0), matches.At(i, 1));
          if (matches.At(i, 0) >= in_a.size() || matches.At(i, 1) >= in_b.size()) {
            RejectDatabase(database, "a match of a feature that its image lacks");
          }
        }
        pair.parallax_rad = ParallaxOf(graph, pair);
      });
  return graph;
}

}  // namespace dtr::colmap
