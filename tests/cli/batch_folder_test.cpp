// SET.batch: whose it is and what it decides. Killed: killed_batch_test.cpp.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "dtr/base/durable.h"
#include "tests/cli/small_batch.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(BatchFolder, WhatARecordNamesIsNotRun) {
  Stop();
  const fs::path trap = folder_ / "trap.sh", sprung = folder_ / "sprung";
  std::ofstream(trap) << "#!/bin/sh\ntouch '" << sprung.string() << "'\n";
  fs::permissions(trap, fs::perms::owner_all);
  Json record = Json::parse(Text(Record()));
  record["program"] = trap.string();
  std::ofstream(Record()) << record;
  const Ran ran = Resume();
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_FALSE(fs::exists(sprung));
  EXPECT_THAT(ran.err, HasSubstr("names the program " + trap.string()));
  ExpectFinished();
}

TEST_F(BatchFolder, AFolderOfSomethingElseIsLeftAlone) {
  const auto expect_untouched = [&](int code, const std::string& text) {
    const auto before = Contents(Folder());
    ExpectRejected(Begin(), code, text);
    ExpectRejected(Resume(), code, text);
    EXPECT_EQ(Contents(Folder()), before);
    EXPECT_FALSE(fs::exists(Set("a").string() + ".partial"));
  };
  fs::create_directories(Folder() / "logs");
  std::ofstream(Folder() / "logs/mine.log") << "precious";
  expect_untouched(2, "expected nothing or the folder of a batch, found something else");
  std::ofstream(Record()) << R"({"jobs": ["of another program"]})";
  expect_untouched(1, "expected what dtr batch writes, found something else");
  fs::remove_all(Folder());
  std::ofstream(Folder()) << "a file";
  ExpectRejected(Begin(), 2, "expected nothing or the folder of a batch, found something else");
  EXPECT_EQ(Text(Folder()), "a file");
}

TEST_F(BatchFolder, ALinkIsNoFolderOfABatch) {
  Stop();
  fs::rename(Folder(), folder_ / "elsewhere");
  fs::create_directory_symlink(folder_ / "elsewhere", Folder());
  const auto before = Contents(folder_ / "elsewhere");
  ExpectRejected(Resume(), 2, "expected nothing or the folder of a batch, found something else");
  EXPECT_EQ(Contents(folder_ / "elsewhere"), before);
}

TEST_F(BatchFolder, WhatOthersMayWriteDecidesNothing) {
  const mode_t mask = umask(0);
  Stop();
  umask(mask);
  struct stat about {};
  ASSERT_EQ(stat(Folder().c_str(), &about), 0);
  EXPECT_EQ(about.st_mode & 0777, 0755u) << "whatever the umask";
  for (const fs::path& part : {Folder(), Folder() / "logs", Record()}) {
    ASSERT_EQ(stat(part.c_str(), &about), 0);
    chmod(part.c_str(), about.st_mode | S_IWOTH);
    ExpectRejected(Resume(), 2, "every user may write there, and it decides what the batch does");
    ExpectRejected(Begin(), 2, "every user may write there, and it decides what the batch does");
    chmod(part.c_str(), 0755);
  }
  chmod(Folder().c_str(), 0775);
  const Ran ran = Resume();
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("WARNING: " + Folder().string() + ": its group may write there"));
  ExpectFinished();
}

TEST_F(BatchFolder, AnotherUsersIsNotGoneOnWith) {
  if (geteuid() != 0) GTEST_SKIP() << "SKIPPED: not root, files cannot be given away";
  Stop();
  constexpr uid_t kNobody = 65534;
  for (const fs::path& part : {Folder(), Folder() / "logs", Record()}) {
    ASSERT_EQ(chown(part.c_str(), kNobody, kNobody), 0);
    ExpectRejected(Resume(), 2, "what it says is done for its owner alone; choose another name");
    ASSERT_EQ(chown(part.c_str(), 0, 0), 0);
  }
  EXPECT_EQ(DtrOk({"batch", "status", Set("a").string()}).code, 0);
}

TEST_F(BatchFolder, OfAnotherSetItIsRejected) {
  Stop();
  fs::rename(folder_ / "a", folder_ / "b");
  ExpectRejected(DtrByItself({"batch", "resume", Set("b").string()}), 1,
                 "expected the batch of that set, found that of");
  EXPECT_FALSE(fs::exists(folder_ / "a"));
}

TEST_F(BatchFolder, OneBatchWorksOnASetAtATime) {
  const std::string busy = "another dtr batch works on this set; wait for it";
  Ran second_begin, second_resume;
  const Ran first = Begin({SIGCONT, [&] {
                             if (!fs::exists(Done("capture_1_of_1"))) return false;
                             second_begin = Begin();
                             second_resume = Resume();
                             return true;
                           }});
  EXPECT_EQ(first.code, 0) << first.err;
  ExpectRejected(second_begin, 2, busy);
  ExpectRejected(second_resume, 2, busy);
  ExpectFinished();
}

}  // namespace
}  // namespace dtr::testing
