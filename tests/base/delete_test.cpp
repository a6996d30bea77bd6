#include "dtr/base/delete.h"

#include <gtest/gtest.h>

#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "tests/support/test_data.h"

namespace dtr {
namespace {

namespace fs = std::filesystem;
using testing::TemporaryFolder;

// A folder of somebody else, and one of ours with links to it and to a file in it.
class Deleting : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_ / "user/below");
    fs::create_directories(folder_ / "ours/below");
    for (const char* file :
         {"user/a", "user/below/b", "user/x.tmp1", "ours/mark", "ours/below/c"}) {
      WriteFileAtomically(folder_ / file, "p");
    }
    fs::create_directory_symlink("../user", folder_ / "ours/folder");
    fs::create_directory_symlink("../../user", folder_ / "ours/below/folder");
    fs::create_symlink("../user/a", folder_ / "ours/file");
    fs::create_directory_symlink("user", folder_ / "link");
  }
  void ExpectUntouched() const {
    for (const char* file : {"user/a", "user/below/b", "user/x.tmp1"}) {
      EXPECT_TRUE(fs::exists(folder_ / file)) << file;
    }
  }
  TemporaryFolder folder_;
};

TEST_F(Deleting, ATreeTakesLinksAndNotWhatTheyLeadTo) {
  RemoveTree(folder_ / "ours/");
  EXPECT_FALSE(fs::exists(folder_ / "ours"));
  RemoveTree(folder_ / "link/");
  EXPECT_FALSE(fs::exists(fs::symlink_status(folder_ / "link")));
  EXPECT_NO_THROW(RemoveTree(folder_ / "nothing"));
  EXPECT_TRUE(TryRemoveTree(folder_ / "nothing"));
  ExpectUntouched();
}

TEST_F(Deleting, AFolderNeedsItsMarkOrNothingInIt) {
  EXPECT_THROW(RemoveFolder(folder_ / "user", "mark"), fs::filesystem_error);
  EXPECT_THROW(RemoveFolder(folder_ / "link", "a"), fs::filesystem_error);
  // A link is no mark.
  EXPECT_THROW(RemoveFolder(folder_ / "ours", "file"), fs::filesystem_error);
  EXPECT_TRUE(fs::exists(folder_ / "ours/below/c"));
  RemoveFolder(folder_ / "ours", "mark");
  EXPECT_FALSE(fs::exists(folder_ / "ours"));
  fs::create_directory(folder_ / "empty");
  RemoveFolder(folder_ / "empty", "mark");
  EXPECT_FALSE(fs::exists(folder_ / "empty"));
  ExpectUntouched();
}

TEST_F(Deleting, AFolderIsClearedButForOneFileAndNeverThroughALink) {
  EXPECT_THROW(ClearFolder(folder_ / "link", "a"), fs::filesystem_error);
  ClearFolder(folder_ / "ours", "mark");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "ours"), {}), 1);
  EXPECT_TRUE(fs::exists(folder_ / "ours/mark"));
  ExpectUntouched();
}

TEST_F(Deleting, FilesAndLinksGoAloneAndFullFoldersStay) {
  RemoveFile(folder_ / "ours/file");
  RemoveFile(folder_ / "ours/folder");
  RemoveFile(folder_ / "ours/nothing");
  EXPECT_THROW(RemoveFile(folder_ / "ours/below"), fs::filesystem_error);
  EXPECT_FALSE(TryRemoveFile(folder_ / "ours/below"));
  EXPECT_TRUE(TryRemoveFile(folder_ / "ours/mark"));
  ExpectUntouched();
}

TEST_F(Deleting, TemporaryFilesAreNotLookedForBehindLinks) {
  WriteFileAtomically(folder_ / "ours/y.tmp22", "");
  RemoveTemporaryFiles(folder_ / "ours");
  EXPECT_FALSE(fs::exists(folder_ / "ours/y.tmp22"));
  EXPECT_THROW(RemoveTemporaryFiles(folder_ / "link"), Error);
  ExpectUntouched();
}

TEST_F(Deleting, WorkWithLinksIsRejectedUnlessTheyAreOurs) {
  EXPECT_THROW(RejectLinks(folder_ / "ours"), UsageError);
  EXPECT_THROW(RejectLinks(folder_ / "link"), UsageError);
  EXPECT_NO_THROW(RejectLinks(folder_ / "user"));
  EXPECT_NO_THROW(RejectLinks(folder_ / "nothing"));
  EXPECT_NO_THROW(RejectLinks(folder_ / "ours", [](const fs::path& inside) {
    return inside.filename() == "folder" || inside == "file";
  }));
}

TEST_F(Deleting, LocksAndJournalsAreNotOpenedThroughLinks) {
  EXPECT_THROW(FileLock::Try(folder_ / "ours/file"), Error);
  EXPECT_THROW(AppendDurably(folder_ / "ours/file", "x"), Error);
  EXPECT_EQ(ReadFile(folder_ / "user/a", 10), "p");
}

}  // namespace
}  // namespace dtr
