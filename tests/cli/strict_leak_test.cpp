// --holdout-strict with the real COLMAP: from the photos on, a held-out photo changes nothing but
// its own pose and what lies in held_out/.
#include <gtest/gtest.h>
#include <signal.h>

#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "dtr/base/hash.h"
#include "dtr/base/process.h"
#include "tests/cli/arc_photos.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr size_t kChanged = 4;  // every:4 holds out 0000, 0004 and 0008
constexpr char kChangedPhoto[] = "0004.jpg";

// Makes a partial set that of a build from these photos, as if that had been interrupted.
void ClaimPhotos(const fs::path& partial, const fs::path& photos) {
  const fs::path file = partial / "work/fingerprint.json";
  Json fingerprint = Json::parse(Text(file));
  for (Json& photo : fingerprint["photos"]) {
    photo["sha256"] = Sha256OfFile(photos / photo["name"].get<std::string>());
  }
  WriteFileAtomically(file, fingerprint.dump(2) + "\n");
}

TEST(StrictHoldout, APhotoChangesNothingButItsOwnPoseFromThePhotosOn) {
  if (FindProgram("colmap").empty()) GTEST_SKIP() << "colmap is absent";
  const TemporaryFolder folder;
  MakeArcPhotos(folder / "a");
  MakeArcPhotos(folder / "noisy", 4);
  fs::copy(folder / "a", folder / "b", fs::copy_options::recursive);
  // The same EXIF, other pixels: it still registers, elsewhere.
  fs::copy_file(folder / "noisy/images" / kChangedPhoto, folder / "b/images" / kChangedPhoto,
                fs::copy_options::overwrite_existing);
  // COLMAP is not repeatable, so both builds go on from one calibration: the first is cut off
  // behind it, and the second is given what that left. A checkpoint holds for the second only if
  // nothing it was made from has changed with the photo; the photo's own is made again.
  const auto build = [&](const std::string& side) -> std::vector<std::string> {
    return {"build",
            (folder / side / "images").string(),
            "-o",
            (folder / side / "set.dtr").string(),
            "--holdout",
            "every:4",
            "--holdout-strict",
            "--max-size",
            "240",
            "--threads",
            "1"};
  };
  const fs::path left = folder / "a/set.dtr.partial", given = folder / "b/set.dtr.partial";
  const auto calibrated = [&] { return FilesIn(left / "images") > 0; };
  const Ran cut = Dtr(build("a"), {SIGKILL, calibrated});
  ASSERT_EQ(cut.signal, SIGKILL) << cut.err;
  fs::create_directories(given);
  fs::copy(left / "work", given / "work",
           fs::copy_options::recursive | fs::copy_options::copy_symlinks);
  fs::remove_all(given / "work/views");
  fs::remove(given / "work/calibration/photos" / kChangedPhoto);
  ClaimPhotos(given, folder / "b/images");
  DtrOk(build("a"));
  EXPECT_THAT(DtrOk(build("b")).err, ::testing::Not(::testing::HasSubstr("== mapping")));

  auto a = Contents(folder / "a/set.dtr"), b = Contents(folder / "b/set.dtr");
  Json set_a = Json::parse(a["set.json"]), set_b = Json::parse(b["set.json"]);
  ASSERT_EQ(set_a["frames"][0]["views"].size(), 9u) << "a photo did not register";
  ASSERT_EQ(set_b["frames"][0]["views"].size(), 9u) << "a photo did not register";
  // Stored without observations, they cannot be tested like the others: named, and no failure.
  bool told = false;
  for (const Json& test : set_a["verdict"]["tests"]) {
    if (test["name"] != "cameras_untested") continue;
    told = true;
    EXPECT_TRUE(test["passed"]) << test;
    EXPECT_THAT(test["reason"].get<std::string>(),
                ::testing::HasSubstr("0000.jpg, 0004.jpg, 0008.jpg"));
  }
  EXPECT_TRUE(told);
  const auto pose = [](const Json& set) {
    return set["frames"][0]["views"][kChanged]["cam_from_world"];
  };
  EXPECT_NE(pose(set_a), pose(set_b)) << "the photo was not registered again";
  for (Json* set : {&set_a, &set_b}) {
    Json& view = (*set)["frames"][0]["views"][kChanged];
    EXPECT_EQ(view["name"], kChangedPhoto);
    view.erase("cam_from_world");
    view.erase("reference_baseline");  // of its own pose to the sources
  }
  EXPECT_EQ(set_a, set_b) << Json::diff(set_a, set_b);
  a.erase("set.json");
  b.erase("set.json");
  EXPECT_THAT(DifferingFiles(a, b),
              ::testing::ElementsAre("held_out/files.json", "held_out/images/0004.png"));
}

}  // namespace
}  // namespace dtr::testing
