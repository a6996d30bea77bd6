#include "pipeline/core/depth/plane_files.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "tests/support/test_data.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr char kMadeFrom[] = "cameras";

stereo::PlaneMap Planes() {
  stereo::PlaneMap map{Grid<float>(3, 2, 1, 0.5f), Grid<float>(3, 2, 1, -1e-3f), Grid<float>(3, 2),
                       2.5};
  map.inverse_depth(2, 1) = 0.25f;
  return map;
}

class PlaneFilesTest : public ::testing::Test {
 private:
  testing::TemporaryFolder parent_;  // of this test alone: several run at a time

 protected:
  fs::path folder_ = parent_ / "planes";
};

TEST_F(PlaneFilesTest, GivesBackWhatWasSavedAlsoToALaterRun) {
  PlaneFiles(folder_, kMadeFrom).Save(1, 4, Planes());
  PlaneFiles(folder_, kMadeFrom).Save(1, 5, {});
  PlaneFiles later(folder_, kMadeFrom);
  EXPECT_TRUE(later.Has(1, 4));
  EXPECT_FALSE(later.Has(0, 4));
  EXPECT_EQ(*later.Load(1, 4), Planes());
  EXPECT_TRUE(later.Load(1, 5)->empty());
  later.Save(2, 4, Planes());
  later.Drop(1);
  EXPECT_FALSE(later.Has(1, 4));
  EXPECT_TRUE(later.Has(2, 4));
}

TEST_F(PlaneFilesTest, ThoseOfAnotherCalibrationAreNotTaken) {
  PlaneFiles(folder_, kMadeFrom).Save(1, 4, Planes());
  EXPECT_FALSE(PlaneFiles(folder_, "others").Has(1, 4));
  EXPECT_FALSE(PlaneFiles(folder_, kMadeFrom).Has(1, 4));  // they are gone
  PlaneFiles(folder_, kMadeFrom).Save(1, 4, Planes());
  EXPECT_TRUE(PlaneFiles(folder_, kMadeFrom).Has(1, 4));
  WriteFileAtomically(folder_ / "made_from", "cameras, and more");
  EXPECT_FALSE(PlaneFiles(folder_, kMadeFrom).Has(1, 4));
  PlaneFiles(folder_, kMadeFrom).Save(1, 4, Planes());
  fs::remove(folder_ / "made_from");  // of an older version
  EXPECT_FALSE(PlaneFiles(folder_, kMadeFrom).Has(1, 4));
}

TEST_F(PlaneFilesTest, ThoseOfOtherCamerasStayWhereProcessesShareTheFolder) {
  PlaneFiles(folder_, kMadeFrom).Save(1, 4, Planes());
  EXPECT_THROW(PlaneFiles(folder_, "others", true), Error);
  EXPECT_TRUE(PlaneFiles(folder_, kMadeFrom, true).Has(1, 4));
}

TEST_F(PlaneFilesTest, RejectsEveryTruncatedOrDamagedFile) {
  PlaneFiles files(folder_, kMadeFrom);
  files.Save(0, 0, Planes());
  const fs::path file = folder_ / "round0_view0.planes";
  const std::string whole = ReadFile(file, 1000);
  for (size_t size = 0; size < whole.size(); ++size) {
    WriteFileAtomically(file, whole.substr(0, size));
    EXPECT_THROW(files.Load(0, 0), Error) << size;
  }
  WriteFileAtomically(file, whole + "x");
  EXPECT_THROW(files.Load(0, 0), Error);
  std::string infinite = whole;
  const float value = std::numeric_limits<float>::infinity();
  std::memcpy(infinite.data() + whole.size() - sizeof(value), &value, sizeof(value));
  WriteFileAtomically(file, infinite);
  EXPECT_THROW(files.Load(0, 0), Error);
  std::string huge = whole;
  const std::int32_t side = std::numeric_limits<std::int32_t>::max();
  std::memcpy(huge.data(), &side, sizeof(side));
  WriteFileAtomically(file, huge);
  EXPECT_THROW(files.Load(0, 0), Error);
}

TEST_F(PlaneFilesTest, AFolderThatIsGoneIsOneLine) {
  PlaneFiles files(folder_, kMadeFrom);
  files.Save(0, 0, Planes());
  fs::remove_all(folder_);
  WriteFileAtomically(folder_, "a file");  // what lies below can neither be looked for nor listed
  EXPECT_THROW(files.Drop(0), Error);
  EXPECT_FALSE(files.Has(0, 0));
  fs::remove(folder_);
  fs::create_directory_symlink(folder_, folder_);  // a circle
  EXPECT_THROW(files.Has(0, 0), Error);
  EXPECT_THROW(files.Drop(0), Error);
}

}  // namespace
}  // namespace dtr::pipeline
