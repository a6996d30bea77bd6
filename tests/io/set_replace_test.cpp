// A set comes into its place, whole or not at all, over an old one or none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/inotify.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/set_io.h"
#include "tests/io/small_set.h"
#include "tests/support/message_of.h"
#include "tests/support/test_data.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::MessageOf;
using testing::TemporaryFolder;
using namespace testing_support;

TEST(SetWriter, AFinishedSetIsReplacedOnlyByForce) {
  const TemporaryFolder folder;
  const fs::path target = folder / "small.dtr";
  WriteSmallSet(target);
  fs::create_directories(target / "mesh");
  WriteFileAtomically(target / "mesh/old", "of the old set");
  EXPECT_THROW(SetWriter(target, kFingerprint, false), UsageError);
  {
    SetWriter writer(target, kFingerprint, true);
    EXPECT_TRUE(fs::exists(target / "mesh/old"));  // until the new one is whole
    WriteSmallSet(writer);
  }
  EXPECT_FALSE(fs::exists(target / "mesh/old"));
  EXPECT_FALSE(fs::exists(folder / "small.dtr.replaced"));
  EXPECT_THAT(VerifySet(target), IsEmpty());
}

TEST(SetWriter, ForceReplacesNothingThatIsNoSet) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "photos");
  WriteFileAtomically(folder / "photos/a.jpg", "precious");
  EXPECT_THROW(SetWriter(folder / "photos", "{}", true), UsageError);
  EXPECT_TRUE(fs::exists(folder / "photos/a.jpg"));
  fs::create_directories(folder / "empty.dtr");
  EXPECT_NO_THROW(WriteSmallSet(folder / "empty.dtr", true));
}

TEST(SetWriter, WhatSomebodyKeepsInASetIsNotReplacedWithIt) {
  const TemporaryFolder folder;
  const fs::path target = folder / "small.dtr";
  WriteSmallSet(target);
  WriteFileAtomically(target / "notes.txt", "mine");
  EXPECT_THAT(MessageOf<UsageError>([&] { SetWriter(target, kFingerprint, true); }),
              HasSubstr("found notes.txt; move it away"));
  EXPECT_TRUE(fs::exists(target / "notes.txt"));
  EXPECT_FALSE(fs::exists(folder / "small.dtr.partial"));
  fs::create_directories(target / "report");
  fs::rename(target / "notes.txt", target / "report/notes.txt");
  EXPECT_THROW(SetWriter(target, kFingerprint, true), UsageError);
  fs::remove(target / "report/notes.txt");
  WriteFileAtomically(target / ".DS_Store", "nobody's");
  EXPECT_NO_THROW(WriteSmallSet(target, true));
}

TEST(SetWriter, AReplacementCutOffHalfWayGivesTheOldSetBack) {
  const TemporaryFolder folder;
  WriteSmallSet(folder / "small.dtr");
  fs::rename(folder / "small.dtr", folder / "small.dtr.replaced");  // as a crash leaves it
  EXPECT_THROW(SetWriter(folder / "small.dtr", kFingerprint, false), UsageError);
  EXPECT_THAT(VerifySet(folder / "small.dtr"), IsEmpty());
  EXPECT_FALSE(fs::exists(folder / "small.dtr.replaced"));
  // An empty folder in its place is no set.
  fs::rename(folder / "small.dtr", folder / "small.dtr.replaced");
  fs::create_directories(folder / "small.dtr");
  EXPECT_THROW(SetWriter(folder / "small.dtr", kFingerprint, false), UsageError);
  EXPECT_THAT(VerifySet(folder / "small.dtr"), IsEmpty());
}

TEST(SetWriter, WhatLiesWhereTheOldSetMustGoIsRejectedBeforeAnyWork) {
  const TemporaryFolder folder;
  WriteSmallSet(folder / "small.dtr");
  fs::create_directories(folder / "small.dtr.replaced/thesis");
  EXPECT_THAT(MessageOf<UsageError>([&] { SetWriter(folder / "small.dtr", kFingerprint, true); }),
              HasSubstr("small.dtr.replaced: expected nothing"));
  EXPECT_TRUE(fs::exists(folder / "small.dtr.replaced/thesis"));
  EXPECT_THAT(VerifySet(folder / "small.dtr"), IsEmpty());
}

TEST(SetWriter, KilledAsTheSetComesIntoPlaceLeavesNoWorkInIt) {
  constexpr int kCheckpoints = 2000;  // deleting them takes longer than noticing the set
  const TemporaryFolder folder;
  const fs::path target = folder / "small.dtr";
  const int watch = inotify_init1(IN_CLOEXEC);
  ASSERT_GE(inotify_add_watch(watch, folder.path().c_str(), IN_MOVED_TO), 0);
  const pid_t child = fork();
  if (child == 0) {
    SetWriter writer(target, kFingerprint, false);
    for (int i = 0; i < kCheckpoints; ++i) {
      std::ofstream(writer.work_folder() / ("checkpoint" + std::to_string(i))) << i;
    }
    WriteSmallSet(writer);
    _exit(0);
  }
  alignas(inotify_event) char events[1 << 12];
  while (!fs::exists(target)) ASSERT_GT(read(watch, events, sizeof events), 0);
  kill(child, SIGKILL);
  close(watch);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_FALSE(fs::exists(target / "work"));
  EXPECT_THAT(VerifySet(target), IsEmpty());
  EXPECT_THROW(SetWriter(target, kFingerprint, false), UsageError);  // it is there already
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
}

TEST(SetWriter, CutOffBeforeTheSetComesIntoPlaceItGoesOn) {
  const TemporaryFolder folder;
  const fs::path target = folder / "small.dtr";
  WriteSmallSet(target);
  const auto whole = Contents(target);
  for (const bool replaced : {false, true}) {
    if (!replaced) fs::remove_all(target);
    {
      SetWriter writer(target, kFingerprint, replaced);
      View view = SmallView(0);
      writer.WriteView(view, LengthUnit::kMetre);
    }
    fs::rename(folder / "small.dtr.partial/work", folder / "small.dtr.partial.work");
    if (replaced) fs::rename(target, folder / "small.dtr.replaced");
    {
      SetWriter writer(target, kFingerprint, replaced);
      EXPECT_TRUE(writer.resumed());
      EXPECT_EQ(fs::exists(target / "set.json"), replaced);
      View view = SmallView(0);
      EXPECT_TRUE(writer.RestoreView(view));
      WriteSmallSet(writer);
    }
    EXPECT_EQ(Contents(target), whole);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
  }
  // Somebody's folder of that name is left alone.
  fs::create_directories(folder / "other.dtr.partial.work/thesis");
  { SetWriter writer(folder / "other.dtr", kFingerprint, false); }
  EXPECT_TRUE(fs::exists(folder / "other.dtr.partial.work/thesis"));
}

// A process that is killed while it writes a file leaves the part under a name of its own.

}  // namespace
}  // namespace dtr::io
