// `dtr build` killed before its calibration stands. COLMAP is not repeatable, so what is asked of
// the finished set is the same scene, not the same bytes.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <optional>

#include "calib/similarity.h"
#include "dtr/base/process.h"
#include "dtr/base/random.h"
#include "dtr/io/set_io.h"
#include "tests/cli/arc_photos.h"
#include "tests/cli/nobody.h"
#include "tests/cli/resuming.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using Points = std::vector<Eigen::Vector3d>;

constexpr int kKills = 10;
constexpr double kMaxShift = 0.01;  // of the median distance to the next camera

std::vector<std::string> Build(const fs::path& photos, const fs::path& set) {
  return {"build", photos.string(), "-o", set.string(), "--max-size", "96", "--passes",
          "1",     "--iterations",  "1",  "--threads",  "1"};
}

// In the order of their names, whatever the order of registration.
Points Centres(const fs::path& set_folder) {
  DtrSet set = io::ReadSet(set_folder);
  std::vector<View>& views = set.frames.at(0).views;
  std::sort(views.begin(), views.end(),
            [](const View& a, const View& b) { return a.name < b.name; });
  Points centres;
  for (const View& view : views) centres.push_back(view.CenterInWorld());
  return centres;
}

double MedianNeighbourBaseline(const Points& centres) {
  std::vector<double> distances;
  for (size_t i = 1; i < centres.size(); ++i) {
    distances.push_back((centres[i] - centres[i - 1]).norm());
  }
  std::nth_element(distances.begin(), distances.begin() + distances.size() / 2, distances.end());
  return distances[distances.size() / 2];
}

void ExpectSameCameras(const Points& expected, const Points& found) {
  ASSERT_EQ(found.size(), expected.size()) << "a photo did not register";
  const calib::Similarity aligned = calib::AlignPoints(found, expected);
  const double baseline = MedianNeighbourBaseline(expected);
  for (size_t i = 0; i < found.size(); ++i) {
    EXPECT_LT((aligned * found[i] - expected[i]).norm(), kMaxShift * baseline) << i;
  }
}

class ResumingSfm : public ::testing::Test {
 protected:
  void SetUp() override {
    if (FindProgram("colmap").empty()) GTEST_SKIP() << "SKIPPED: colmap is absent";
    MakeArcPhotos(folder_ / "arc");
  }
  fs::path Photos() const { return folder_ / "arc/images"; }
  TemporaryFolder folder_;
};

TEST_F(ResumingSfm, KilledBeforeItsCheckpointTheSameSceneComesOut) {
  const fs::path photos = Photos();
  const auto start = Clock::now();
  std::optional<Clock::time_point> calibrated_at;
  const fs::path undisturbed = folder_ / "undisturbed.dtr";
  const Ran whole =
      Dtr(Build(photos, undisturbed),
          {SIGKILL, [&] {
             if (!calibrated_at && FilesIn(undisturbed.string() + ".partial/images") > 0) {
               calibrated_at = Clock::now();
             }
             return false;
           }});
  ASSERT_EQ(whole.code, 0) << whole.err;
  ASSERT_TRUE(calibrated_at);
  const Points expected = Centres(undisturbed);
  ASSERT_EQ(expected.size(), size_t{kArcPhotos});

  Random random(7);
  Clock::duration until_checkpoint = *calibrated_at - start;
  for (int killed = 0; killed < kKills;) {
    const fs::path set = folder_ / ("killed" + std::to_string(killed) + ".dtr");
    const auto moment = random.Uniform(0, 1) * until_checkpoint;
    const auto begun = Clock::now();
    const Ran cut =
        Dtr(Build(photos, set), {SIGKILL, [&] { return Clock::now() - begun >= moment; }});
    if (cut.signal != SIGKILL) {
      // A machine with less to do than at the start: the whole run was over before the moment.
      ASSERT_EQ(cut.code, 0) << cut.err;
      until_checkpoint = until_checkpoint * 2 / 3;
    } else if (FilesIn(set.string() + ".partial/images") == 0) {
      DtrOk(Build(photos, set));
      EXPECT_FALSE(fs::exists(set.string() + ".partial"));
      ExpectSameCameras(expected, Centres(set));
      ++killed;
    }  // else past the checkpoint of a faster run: that is resume_full_test's matter
    fs::remove_all(set);
    fs::remove_all(set.string() + ".partial");
  }
}

// Room in KiB that ends, of COLMAP's 9 photos of 480x320: before and among the photos, in the
// features, in their copy for matching, in the matches, with a little and with all of the rest.
constexpr long kRooms[] = {64, 500, 2400, 5600, 6400, 9000, 64000};

// COLMAP 3.8 goes on and ends with 0 when its database is full: what it then lacks must be missed.
TEST_F(ResumingSfm, AFullDiskIsSaidAndTheSameCommandContinuesWithRoom) {
  const fs::path undisturbed = folder_ / "undisturbed.dtr";
  DtrOk(Build(Photos(), undisturbed));
  const SmallDisk disk(folder_ / "disk");
  if (!disk.mounted()) GTEST_SKIP() << "SKIPPED: no file system can be mounted here";
  const fs::path set = folder_ / "disk/set.dtr";
  const fs::path features = set.string() + ".partial/work/calibration/sfm/features.done.json";
  std::optional<fs::file_time_type> features_at;
  int stops = 0;
  for (const long kib : kRooms) {
    disk.Grow(kib);
    const Ran ran = Dtr(Build(Photos(), set));
    if (ran.code == 0) break;
    ++stops;
    ExpectRejected(ran, kFailed, "No space left on device");
    EXPECT_FALSE(fs::exists(set)) << kib;
    if (!fs::exists(features)) continue;
    if (!features_at) features_at = fs::last_write_time(features);
    EXPECT_EQ(fs::last_write_time(features), *features_at) << "found again with " << kib << " KiB";
  }
  EXPECT_GE(stops, 4);
  EXPECT_TRUE(features_at) << "no stop after the features";
  ASSERT_TRUE(fs::exists(set));
  EXPECT_FALSE(fs::exists(set.string() + ".partial"));
  ExpectSameCameras(Centres(undisturbed), Centres(set));
}

// Neither can be linked to: COLMAP gets copies.
TEST_F(ResumingSfm, PhotosOfSomebodyElseThatMayOnlyBeReadAreRegistered) {
  const auto before = Contents(Photos());
  for (const auto& entry : fs::directory_iterator(Photos())) {
    fs::permissions(entry.path(), fs::perms(0444));
  }
  fs::permissions(Photos(), fs::perms(0555));
  fs::permissions(folder_.path(), fs::perms(0555));
  AsNobody::MakeFolder(folder_ / "mine");
  {
    const AsNobody nobody;
    DTR_REQUIRE_NOBODY(nobody);
    DtrOk(Build(Photos(), folder_ / "mine/set.dtr"));
  }
  EXPECT_EQ(Centres(folder_ / "mine/set.dtr").size(), size_t{kArcPhotos});
  EXPECT_EQ(Contents(Photos()), before);
}

}  // namespace
}  // namespace dtr::testing
