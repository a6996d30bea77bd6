#include "calib/colmap/graph_database.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <Eigen/Geometry>
#include <limits>

#include "calib/colmap/database.h"
#include "dtr/base/error.h"
#include "tests/support/message_of.h"
#include "tests/support/test_data.h"
#include "tests/support/truncation.h"

namespace dtr::colmap {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const std::vector<calib::LensCamera> kCameras{
    {calib::CameraModel::kRadial, 640, 480, {500, 320, 240, -0.1, 0.01}}};

sfm::Features SomeFeatures(float offset) {
  sfm::Features features;
  for (int i = 0; i < 20; ++i) {
    const auto at = static_cast<float>(i);
    features.keypoints.push_back({30 * at + offset, 20 * at + 3, 1.5f, 0.1f * at});
    sfm::Descriptor descriptor{};
    descriptor[static_cast<size_t>(i)] = static_cast<std::uint8_t>(200 + i);
    features.descriptors.push_back(descriptor);
  }
  return features;
}

// Two images whose 18 common features are seen 5 degrees apart.
sfm::ViewGraph SomeGraph() {
  sfm::ViewGraph graph;
  graph.cameras = kCameras;
  graph.cameras[0].params[0] = 512.5;
  graph.focal_is_known = {true};
  for (const float offset : {1.0f, 45.0f}) {
    sfm::GraphImage image{offset < 2 ? "a.jpg" : "b.jpg", 0, {}};
    for (const sfm::Keypoint& k : SomeFeatures(offset).keypoints) {
      image.pixels.emplace_back(k.x_px, k.y_px);
    }
    graph.images.push_back(image);
  }
  sfm::PairGeometry pair;
  pair.image_b = 1;
  pair.kind = sfm::PairKind::kCalibrated;
  pair.b_rotation_a = Eigen::AngleAxisd(0.2, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
  pair.b_translation_a = Eigen::Vector3d(3, -1, 2).normalized();
  for (std::uint32_t i = 0; i < 18; ++i) pair.matches.emplace_back(i, i + 1);
  graph.pairs.push_back(pair);
  return graph;
}

class GraphDatabase : public ::testing::Test {
 protected:
  GraphDatabase() : file_(folder_ / "database.db") {
    CreateGraphDatabase(file_, kCameras, {false},
                        std::vector<DatabaseImage>{{"a.jpg", 0}, {"b.jpg", 0}});
    AddFeatures(file_, std::vector<size_t>{0, 1}, std::vector{SomeFeatures(1), SomeFeatures(45)});
    WriteViewGraph(file_, SomeGraph());
  }

  void Execute(const char* command) {
    sqlite3* opened = nullptr;
    ASSERT_EQ(sqlite3_open(file_.c_str(), &opened), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(opened, command, nullptr, nullptr, nullptr), SQLITE_OK) << command;
    sqlite3_close(opened);
  }

  const dtr::testing::TemporaryFolder folder_;
  const fs::path file_;
};

TEST_F(GraphDatabase, GivesBackWhatWasWritten) {
  const sfm::ViewGraph wrote = SomeGraph(), read = ReadViewGraph(file_);
  ASSERT_EQ(read.images.size(), 2u);
  EXPECT_EQ(read.images[1].name, "b.jpg");
  EXPECT_EQ(read.images[1].pixels, wrote.images[1].pixels);
  EXPECT_EQ(read.cameras[0].params, wrote.cameras[0].params);
  EXPECT_EQ(read.focal_is_known, wrote.focal_is_known);
  ASSERT_EQ(read.pairs.size(), 1u);
  EXPECT_EQ(read.pairs[0].matches, wrote.pairs[0].matches);
  EXPECT_EQ(read.pairs[0].kind, sfm::PairKind::kCalibrated);
  EXPECT_TRUE(read.pairs[0].b_rotation_a.isApprox(wrote.pairs[0].b_rotation_a, 1e-14));
  EXPECT_EQ(read.pairs[0].b_translation_a, wrote.pairs[0].b_translation_a);
  EXPECT_GT(read.pairs[0].parallax_rad, 0);

  const sfm::Features features = ReadFeatures(file_, 2);
  EXPECT_EQ(features.descriptors, SomeFeatures(45).descriptors);
  EXPECT_EQ(features.keypoints[3].x_px, SomeFeatures(45).keypoints[3].x_px);
  EXPECT_EQ(features.keypoints[3].orientation_rad, SomeFeatures(45).keypoints[3].orientation_rad);
}

TEST_F(GraphDatabase, IsReadLikeOneOfColmaps) {
  const auto ids = ReadDatabaseIds(file_);
  EXPECT_EQ(ids.at("b.jpg").image_id, 2u);
  const DatabaseMatches matches = ReadDatabaseMatches(file_);
  ASSERT_EQ(matches.pairs.size(), 1u);
  EXPECT_EQ(matches.pairs[0].common, 18);
  EXPECT_EQ(matches.features.at(1), 20);
}

TEST_F(GraphDatabase, FeaturesAndMatchesMayBeWrittenAgain) {
  AddFeatures(file_, std::vector<size_t>{1}, std::vector{SomeFeatures(7)});
  EXPECT_EQ(ReadFeatures(file_, 2).keypoints[0].x_px, 7);
  WriteViewGraph(file_, SomeGraph());
  EXPECT_EQ(ReadViewGraph(file_).pairs.size(), 1u);
}

TEST_F(GraphDatabase, AFileCutShortIsRejected) {
  dtr::testing::ExpectEveryPrefixIsAnError(file_, 4096, [&] {
    ReadViewGraph(file_);
    ReadFeatures(file_, 1);
    ReadFeatures(file_, 2);
  });
}

TEST_F(GraphDatabase, RecordsThatCannotBeAreRejected) {
  const auto message_after = [&](const char* command) {
    Execute(command);
    return dtr::testing::MessageOf<Error>([&] {
      ReadFeatures(file_, 2);
      ReadViewGraph(file_);
    });
  };
  EXPECT_THAT(message_after("UPDATE two_view_geometries SET rows = 2, cols = 2, "
                            "data = X'00000000FFFFFF7F0000000000000000'"),
              HasSubstr("a match of a feature that its image lacks"));
  EXPECT_THAT(message_after("UPDATE two_view_geometries SET qvec = NULL"),
              HasSubstr("without the rotation"));
  EXPECT_THAT(message_after("UPDATE two_view_geometries SET config = 99"),
              HasSubstr("a pair of kind 99"));
  EXPECT_THAT(message_after("UPDATE cameras SET model = 99"),
              HasSubstr("a camera of the model 99"));
  EXPECT_THAT(message_after("UPDATE keypoints SET rows = 0, data = ''"),
              HasSubstr("0 features with"));
  EXPECT_THAT(message_after("UPDATE descriptors SET rows = 1000000000"), HasSubstr("1000000000"));
}

TEST_F(GraphDatabase, AnImageWhoseFeaturesAreLostIsNotOneWithoutAny) {
  Execute("DELETE FROM keypoints WHERE image_id = 2; DELETE FROM descriptors WHERE image_id = 2");
  EXPECT_THAT(dtr::testing::MessageOf<Error>([&] { ReadFeatures(file_, 2); }),
              HasSubstr("no features of image 2"));
}

TEST_F(GraphDatabase, AFolderThatIsNotThereIsSaidSo) {
  EXPECT_THAT(dtr::testing::MessageOf<Error>([&] {
                CreateGraphDatabase(folder_ / "absent" / "database.db", kCameras, {false}, {});
              }),
              HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace dtr::colmap
