// Photos and folders that may only be read, by a user who is not root.
#include "dtr/io/set_io.h"
#include "tests/cli/nobody.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr fs::perms kReadOnly =
    fs::perms::owner_read | fs::perms::group_read | fs::perms::others_read;
constexpr fs::perms kLookOnly =
    kReadOnly | fs::perms::owner_exec | fs::perms::group_exec | fs::perms::others_exec;

class ReadOnly : public ::testing::Test {
 protected:
  void SetUp() override {
    MakeSmallCourtyard(folder_ / "courtyard");
    fs::permissions(folder_.path(), kLookOnly);
    AsNobody::MakeFolder(Mine());
  }
  fs::path Photos() const { return folder_ / "courtyard/images"; }
  fs::path Mine() const { return folder_ / "mine"; }
  void MakeReadOnly() const {
    for (const auto& entry : fs::directory_iterator(Photos())) {
      fs::permissions(entry.path(), kReadOnly);
    }
    fs::permissions(Photos(), kLookOnly);
  }
  std::vector<std::string> Build(const fs::path& photos, const fs::path& set) const {
    return {"build",      photos.string(), "-o",
            set.string(), "--poses",       (folder_ / "courtyard/sparse").string(),
            "--engine",   "none",          "--threads",
            "1"};
  }
  TemporaryFolder folder_;
};

TEST_F(ReadOnly, PhotosOfSomebodyElseBehindLinksAreUsedAndLeftAlone) {
  MakeReadOnly();
  const auto before = Contents(Photos());
  const AsNobody nobody;
  DTR_REQUIRE_NOBODY(nobody);
  fs::create_directories(Mine() / "links");
  for (const auto& entry : fs::directory_iterator(Photos())) {
    fs::create_symlink(entry.path(), Mine() / "links" / entry.path().filename());
  }
  const fs::path linked = Mine() / "linked.dtr", plain = Mine() / "plain.dtr";
  DtrOk(Build(Mine() / "links", linked));
  DtrOk(Build(Photos(), plain));
  EXPECT_EQ(io::ReadSet(linked).frames.at(0).views.size(), size_t{kCourtyardViews});
  EXPECT_THAT(DifferingFiles(Contents(linked / "images"), Contents(plain / "images")),
              ::testing::IsEmpty());
  // A capture is the user's own: it can be changed and thrown away.
  DtrOk({"capture", (Mine() / "links").string(), "-o", (Mine() / "capture").string()});
  for (const auto& entry : fs::directory_iterator(Mine() / "capture/images")) {
    EXPECT_FALSE(entry.is_symlink());
    EXPECT_EQ(access(entry.path().c_str(), W_OK), 0) << entry.path();
  }
  EXPECT_EQ(Contents(Photos()), before);
}

TEST_F(ReadOnly, FoldersThatCannotBeWrittenAndPhotosThatCannotBeReadAreSaidInOneLine) {
  MakeReadOnly();
  fs::permissions(Photos() / "0002.jpg", fs::perms::none);
  const AsNobody nobody;
  DTR_REQUIRE_NOBODY(nobody);
  ExpectRejected(Dtr(Build(Photos(), Photos() / "set.dtr")), kFailed,
                 "cannot be made: Permission denied");
  ExpectRejected(Dtr({"capture", Photos().string(), "-o", (Photos() / "capture").string()}),
                 kFailed, "capture.partial: cannot be written: Permission denied");
  const Ran ran = DtrOk(Build(Photos(), Mine() / "set.dtr"));
  EXPECT_THAT(Text(Mine() / "set.dtr/set.json"), HasSubstr("0002.jpg"));
  EXPECT_EQ(io::ReadSet(Mine() / "set.dtr").frames.at(0).views.size(), size_t{kCourtyardViews} - 1);
}

}  // namespace
}  // namespace dtr::testing
