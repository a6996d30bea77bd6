#include "calib/colmap/graph_database.h"

#include <Eigen/Geometry>
#include <array>
#include <bit>

#include "calib/colmap/database.h"
#include "calib/colmap/sqlite_file.h"
#include "dtr/base/error.h"

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

// A database that is written, all of it or nothing: what Commit() did not confirm is undone.
class Transaction {
 public:
  explicit Transaction(const fs::path& file) : file_(file) {
    sqlite3* opened = nullptr;
    const int failure = sqlite3_open(file.c_str(), &opened);
    handle_.reset(opened);
    if (failure != SQLITE_OK) Fail(sqlite3_errstr(failure));
    Execute("PRAGMA synchronous = OFF");  // after a kill it is made again
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
  Statement insert(transaction, "INSERT INTO cameras VALUES (?, ?, ?, ?, ?, ?)");
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

using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

RowMajor3 EssentialOf(const sfm::PairGeometry& pair) {
  const Eigen::Vector3d& t = pair.b_translation_a;
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  return cross * pair.b_rotation_a;
}

void InsertImages(Transaction& transaction, const sfm::ViewGraph& graph,
                  const sfm::FeatureFile& features) {
  static_assert(sizeof(sfm::Keypoint) == kKeypointColumns * sizeof(float));
  Statement image(transaction, "INSERT INTO images (image_id, name, camera_id) VALUES (?, ?, ?)");
  Statement keypoints(transaction, "INSERT INTO keypoints VALUES (?, ?, ?, ?)");
  Statement descriptors(transaction, "INSERT INTO descriptors VALUES (?, ?, ?, ?)");
  for (size_t i = 0; i < graph.images.size(); ++i) {
    const auto id = static_cast<sqlite3_int64>(i + 1);
    image.Integer(id).Text(graph.images[i].name).Integer(graph.images[i].camera + 1).Run();
    const sfm::Features of_image = features.Of(i);
    const auto count = static_cast<sqlite3_int64>(of_image.keypoints.size());
    keypoints.Integer(id)
        .Integer(count)
        .Integer(kKeypointColumns)
        .Blob(std::span<const sfm::Keypoint>(of_image.keypoints))
        .Run();
    descriptors.Integer(id)
        .Integer(count)
        .Integer(sizeof(sfm::Descriptor))
        .Blob(std::span<const sfm::Descriptor>(of_image.descriptors))
        .Run();
  }
}

}  // namespace

void WriteGraphDatabase(const fs::path& database, const sfm::ViewGraph& graph,
                        const sfm::FeatureFile& features) {
  RemoveDatabase(database);
  Transaction transaction(database);
  transaction.Execute(kLayout);
  InsertCameras(transaction, graph.cameras, graph.focal_is_known);
  InsertImages(transaction, graph, features);
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

}  // namespace dtr::colmap
