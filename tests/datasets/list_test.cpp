#include "datasets/list.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "datasets/scene.h"
#include "dtr/base/error.h"
#include "tests/support/test_data.h"

namespace dtr::datasets {
namespace {

namespace fs = std::filesystem;

TEST(ListDatasets, NamesEverySceneAndEveryPublicSetOnce) {
  std::set<std::string> names;
  for (const DatasetInfo& info : ListDatasets()) {
    EXPECT_TRUE(names.insert(info.name).second) << info.name;
    EXPECT_FALSE(info.summary.empty());
    if (info.is_made_here) {
      EXPECT_FALSE(info.layouts.empty());
    } else {
      EXPECT_FALSE(info.origin.empty());
      EXPECT_FALSE(info.licence.empty());
      EXPECT_GT(info.files, 0);
    }
  }
  for (const std::string& scene : SceneNames()) EXPECT_TRUE(names.count(scene));
  for (const char* set : {"sceaux_castle", "llff_fern", "dtu_scan24", "strecha_fountain_p11"}) {
    EXPECT_TRUE(names.count(set)) << set;
  }
}

TEST(CheckPublicSet, AcceptsTheSharedCopies) {
  DTR_REQUIRE_DATA(testing::DataFolder() / "strecha_fountain_p11");
  for (const char* set : {"strecha_fountain_p11", "chessboard_stereo_640x480"}) {
    const DatasetCheck check = CheckPublicSet(set, testing::DataFolder() / set);
    EXPECT_TRUE(check.Ok()) << set;
    EXPECT_GT(check.files_ok, 20);
  }
}

TEST(CheckPublicSet, NamesMissingAndChangedFiles) {
  const testing::TemporaryFolder folder;
  fs::create_directory(folder / "images");
  std::ofstream(folder / "images/100_7103.JPG") << "not a photo";
  std::ofstream(folder / "notes.txt") << "not of the set";
  const DatasetCheck check = CheckPublicSet("sceaux_castle", folder.path());
  EXPECT_FALSE(check.Ok());
  EXPECT_EQ(check.files_ok, 0);
  EXPECT_EQ(check.changed, std::vector<std::string>{"images/100_7103.JPG"});
  EXPECT_EQ(check.missing.size(), 11u);
  EXPECT_TRUE(std::is_sorted(check.missing.begin(), check.missing.end()));
}

TEST(CheckPublicSet, SaysWhereAnAbsentSetComesFrom) {
  const testing::TemporaryFolder folder;
  try {
    CheckPublicSet("llff_fern", folder / "nowhere");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("CopyRNeRF-code"), std::string::npos);
  }
  EXPECT_THROW(CheckPublicSet("courtyard", folder.path()), UsageError);
  EXPECT_THROW(CheckPublicSet("no_such_set", folder.path()), UsageError);
}

}  // namespace
}  // namespace dtr::datasets
