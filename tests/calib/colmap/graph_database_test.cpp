#include "calib/colmap/graph_database.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "calib/colmap/database.h"
#include "dtr/base/error.h"
#include "tests/calib/sfm/run/some_graph.h"
#include "tests/support/message_of.h"
#include "tests/support/test_data.h"

namespace dtr::colmap {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class GraphDatabase : public ::testing::Test {
 protected:
  GraphDatabase() { sfm::testing::WriteSomeFeatures(folder_ / "features.bin"); }

  void Write(const fs::path& file) const {
    WriteGraphDatabase(file, sfm::testing::SomeGraph(), sfm::FeatureFile(folder_ / "features.bin"));
  }

  const dtr::testing::TemporaryFolder folder_;
};

TEST_F(GraphDatabase, IsReadLikeOneOfColmaps) {
  const fs::path file = folder_ / "database.db";
  Write(file);
  Write(file);  // in the place of the one before
  const auto ids = ReadDatabaseIds(file);
  EXPECT_EQ(ids.size(), 2u);
  EXPECT_EQ(ids.at("b.jpg").image_id, 2u);
  EXPECT_EQ(ReadFeatureCounts(file).at(1), 20);
  int pairs = 0;
  ForEachMatchedPair(file, [&](const MatchedPair& pair) {
    ++pairs;
    EXPECT_EQ(pair.config, 2);  // TwoViewGeometry::CALIBRATED
    ASSERT_EQ(pair.moved_px.size(), 18u);
    EXPECT_NEAR(pair.moved_px[3], std::hypot(44 + 30, 20), 1e-4);
  });
  EXPECT_EQ(pairs, 1);
}

TEST_F(GraphDatabase, AFolderThatIsNotThereIsSaidSo) {
  EXPECT_THAT(dtr::testing::MessageOf<Error>([&] { Write(folder_ / "absent" / "database.db"); }),
              HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace dtr::colmap
