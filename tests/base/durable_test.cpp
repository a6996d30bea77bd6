#include "dtr/base/durable.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "tests/support/message_of.h"
#include "tests/support/small_disk.h"
#include "tests/support/test_data.h"

namespace dtr {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::MessageOf;
using testing::TemporaryFolder;

TEST(TemporaryFiles, AreThoseWithANumberBehindTheirEnding) {
  for (const char* name : {"a.tmp1", "a.json.tmp4194304", ".tmp7"}) {
    EXPECT_TRUE(IsTemporaryFile(name)) << name;
  }
  for (const char* name : {"a.tmp", "a.tmp1.png", "atmp1", "12", "", "a.tmpx1", "tmp1"}) {
    EXPECT_FALSE(IsTemporaryFile(name)) << name;
  }
}

TEST(TemporaryFiles, AreDeletedAndNothingElse) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "below/folder.tmp5");
  for (const char* name : {"a.tmp1", "a", "below/b.tmp22", "below/folder.tmp5/kept.png"}) {
    std::ofstream(folder / name) << name;
  }
  RemoveTemporaryFiles(folder.path());
  EXPECT_FALSE(fs::exists(folder / "a.tmp1"));
  EXPECT_FALSE(fs::exists(folder / "below/b.tmp22"));
  EXPECT_TRUE(fs::exists(folder / "a"));
  EXPECT_TRUE(fs::exists(folder / "below/folder.tmp5/kept.png"));
  EXPECT_THROW(RemoveTemporaryFiles(folder / "nowhere"), Error);
}

TEST(CopyFileAtomically, ReplacesAndLeavesNothingWhereItCannot) {
  const TemporaryFolder folder;
  WriteFileAtomically(folder / "from", "new");
  WriteFileAtomically(folder / "to", "old and longer");
  fs::permissions(folder / "from", fs::perms(0444));
  fs::permissions(folder / "to", fs::perms(0444));
  CopyFileAtomically(folder / "from", folder / "to");
  EXPECT_EQ(ReadFile(folder / "to", 100), "new");
  EXPECT_EQ(fs::status(folder / "to").permissions(), fs::perms(0644));
  EXPECT_THROW(CopyFileAtomically(folder / "nothing", folder / "to"), Error);
  fs::create_directories(folder / "full/of");
  EXPECT_THROW(CopyFileAtomically(folder / "from", folder / "full"), Error);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 3);
}

TEST(AppendDurably, AddsAllOfARecordOrNothing) {
  const TemporaryFolder folder;
  const testing::SmallDisk disk(folder / "disk");
  if (!disk.mounted()) GTEST_SKIP() << "SKIPPED: no file system can be mounted here";
  const fs::path file = folder / "disk/journal";
  AppendDurably(file, "one\n");
  AppendDurably(file, "");
  const std::string large(size_t{1} << 20, 'x');
  EXPECT_THAT(MessageOf<Error>([&] { AppendDurably(file, large); }),
              HasSubstr("journal: cannot be written: No space left on device"));
  AppendDurably(file, "two\n");
  EXPECT_EQ(ReadFile(file, 100), "one\ntwo\n");
  EXPECT_THROW(AppendDurably(folder / "disk", "x"), Error);
}

TEST(CopyFileAtomically, SaysThatADiskIsFull) {
  const TemporaryFolder folder;
  const testing::SmallDisk disk(folder / "disk");
  if (!disk.mounted()) GTEST_SKIP() << "SKIPPED: no file system can be mounted here";
  WriteFileAtomically(folder / "large", std::string(size_t{1} << 20, 'x'));
  EXPECT_THAT(MessageOf<Error>([&] { CopyFileAtomically(folder / "large", folder / "disk/copy"); }),
              ::testing::AllOf(HasSubstr("disk/copy: cannot be copied from "),
                               ::testing::EndsWith(": No space left on device")));
  EXPECT_TRUE(IsEmptyFolder(folder / "disk"));
}

TEST(FileLock, IsHeldOnceAndReleased) {
  const TemporaryFolder folder;
  {
    const auto first = FileLock::Try(folder / "lock");
    EXPECT_TRUE(first);
    EXPECT_FALSE(FileLock::Try(folder / "lock"));
  }
  EXPECT_TRUE(FileLock::Try(folder / "lock"));
  EXPECT_THROW(FileLock::Try(folder / "no folder/lock"), Error);
}

TEST(SyncTree, TakesFilesFoldersAndDanglingLinks) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "a/b");
  WriteFileAtomically(folder / "a/b/file", "x");
  fs::create_symlink("nowhere", folder / "a/link");
  EXPECT_NO_THROW(SyncTree(folder.path()));
  EXPECT_THROW(SyncFile(folder / "nothing"), Error);
}

}  // namespace
}  // namespace dtr
