// What processes that were killed leave is cleared away by the next one, and nothing else is.
#include "dtr/base/work_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>

#include <functional>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "tests/support/message_of.h"
#include "tests/support/test_data.h"

namespace dtr {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::MessageOf;
using testing::TemporaryFolder;

// What `work` leaves when it is killed in the midst of it.
void Killed(const std::function<void(const std::function<void()>& now)>& work) {
  const pid_t child = fork();
  if (child == 0) {
    work([] { raise(SIGKILL); });
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
}

TEST(WorkFolder, WhatAKilledOneLeftIsClearedAndNothingElse) {
  const TemporaryFolder folder;
  const fs::path target = folder / "out", partial = WorkFolder::Of(folder / "out/");
  EXPECT_EQ(partial, folder / "out.partial");
  Killed([&](const auto& now) {
    const WorkFolder work(partial, "thing");
    WriteFileAtomically(work.path() / "old", "x");
    fs::create_directories(work.path() / "below/further");
    now();
  });
  ASSERT_TRUE(fs::exists(partial / "below/further"));
  EXPECT_THAT(MessageOf<UsageError>([&] { WorkFolder(partial, "capture"); }),
              HasSubstr("out.partial: expected nothing or an unfinished capture, found something"));
  ASSERT_TRUE(fs::exists(partial / "old"));
  {
    WorkFolder work(partial, "thing");
    EXPECT_EQ(std::distance(fs::directory_iterator(partial), {}), 1);  // its mark
    WriteFileAtomically(work.path() / "new", "y");
    EXPECT_THAT(MessageOf<UsageError>([&] { WorkFolder(partial, "thing"); }),
                HasSubstr("out.partial: another process is writing this thing; wait for it"));
    work.Become(target);
  }
  EXPECT_EQ(ReadFile(target / "new", 10), "y");
  EXPECT_EQ(std::distance(fs::directory_iterator(target), {}), 1);
  { const WorkFolder given_up(partial, "thing"); }
  EXPECT_FALSE(fs::exists(partial));
}

TEST(WorkFolder, OneThatWasKilledBeforeItsMarkWentIsFinishedByTheNext) {
  const TemporaryFolder folder;
  const fs::path target = folder / "out", partial = WorkFolder::Of(target);
  EXPECT_FALSE(WorkFolder::IsTaken(target, "thing"));
  Killed([&](const auto& now) {
    WorkFolder work(partial, "thing");
    fs::create_directories(work.path() / "below");
    WriteFileAtomically(work.path() / "below/file", "x");
    work.MoveTo(target);
    now();
  });
  ASSERT_TRUE(fs::exists(target / "thing.lock"));
  EXPECT_TRUE(WorkFolder::IsTaken(target, "capture"));
  EXPECT_FALSE(WorkFolder::IsTaken(target / "", "thing"));
  const auto make = [&](const std::string& content) {
    WorkFolder work(partial, "thing");
    fs::create_directories(work.path() / "below");
    WriteFileAtomically(work.path() / "below/file", content);
    work.Become(target);
  };
  EXPECT_THAT(MessageOf<UsageError>([&] { make("y"); }),
              HasSubstr("out: exists already, with other files than this command makes"));
  EXPECT_EQ(ReadFile(target / "below/file", 10), "x");
  EXPECT_TRUE(fs::exists(target / "thing.lock"));
  make("x");
  EXPECT_FALSE(fs::exists(target / "thing.lock"));
  EXPECT_FALSE(fs::exists(partial));
  EXPECT_TRUE(WorkFolder::IsTaken(target, "thing"));
}

TEST(WorkFolder, WhatIsLeftIsClearedWhereNobodyWorks) {
  const TemporaryFolder folder;
  const fs::path partial = folder / "out.partial";
  Killed([&](const auto& now) {
    const WorkFolder work(partial, "thing");
    now();
  });
  WorkFolder::ClearLeft(partial, "capture");
  EXPECT_TRUE(fs::exists(partial));
  WorkFolder::ClearLeft(partial, "thing");
  EXPECT_FALSE(fs::exists(partial));
  const WorkFolder at_work(partial, "thing");
  WorkFolder::ClearLeft(partial, "thing");
  EXPECT_TRUE(fs::exists(partial));
}

TEST(WorkFolder, WhatIsNotItsOwnIsLeftAlone) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "somebodys/folder");
  WriteFileAtomically(folder / "file", "x");
  for (const char* name : {"somebodys", "file"}) {
    EXPECT_THROW(WorkFolder(folder / name, "thing"), UsageError) << name;
    EXPECT_TRUE(fs::exists(folder / name)) << name;
  }
  fs::create_directories(folder / "empty");
  EXPECT_NO_THROW(WorkFolder(folder / "empty", "thing"));
  EXPECT_THAT(MessageOf<Error>([&] { WorkFolder(folder / "file/below", "thing"); }),
              HasSubstr("file/below: cannot be written: Not a directory"));
}

TEST(TemporaryFolder, OneThatOutlivedItsProcessIsRemovedByTheNext) {
  const TemporaryFolder parent;
  const auto left = [&] { return std::distance(fs::directory_iterator(parent.path()), {}); };
  const TemporaryFolder alive(parent.path(), "mine-");
  Killed([&](const auto& now) {
    const TemporaryFolder dead(parent.path(), "mine-");
    fs::create_directories(dead / "below/further");
    now();
  });
  Killed([&](const auto& now) {
    const TemporaryFolder dead(parent.path(), "others-");
    now();
  });
  WriteFileAtomically(parent / "mine-file", "x");
  fs::create_directory_symlink(alive.path(), parent / "mine-link");
  ASSERT_EQ(left(), 5);
  { const TemporaryFolder next(parent.path(), "mine-"); }
  EXPECT_EQ(left(), 4);  // all but the dead one of its prefix
  EXPECT_TRUE(fs::exists(alive.path()));
  EXPECT_TRUE(fs::exists(parent / "mine-file"));
  EXPECT_TRUE(fs::exists(parent / "mine-link"));
  EXPECT_THAT(MessageOf<Error>([&] { TemporaryFolder(parent / "nowhere", "mine-"); }),
              HasSubstr("found: No such file or directory"));
}

}  // namespace
}  // namespace dtr
