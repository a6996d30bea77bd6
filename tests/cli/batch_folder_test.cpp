// SET.batch: whose it is, what it decides, and what is left when `dtr batch` is killed.
#include <dirent.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "dtr/base/durable.h"
#include "dtr/base/random.h"
#include "tests/cli/small_batch.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using std::chrono::steady_clock;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class BatchFolder : public Batch {
 protected:
  fs::path Folder() const { return Set("a").string() + ".batch"; }
  fs::path Record() const { return Folder() / "batch.json"; }
  fs::path Done(const std::string& part) const {
    return Set("a").string() + ".partial/work/parts/" + part + ".done.json";
  }
  Ran Begin(const Interruption& interruption = {}) const {
    return RunBatch("a", {"--local", "2", "--array-size", "3"}, interruption);
  }
  Ran Resume() const { return DtrByItself({"batch", "resume", Set("a").string()}); }
  // Begins it, and ends it once something is there to go on with.
  void Stop(int signal = SIGTERM) const {
    Begin({signal, [&] { return fs::exists(Done("capture_1_of_1")); }});
    ASSERT_TRUE(fs::exists(Record()));
    ASSERT_FALSE(fs::exists(Set("a")));
  }
  void ExpectFinished() const {
    EXPECT_THAT(DifferingFiles(Undisturbed(), Contents(Set("a"))), IsEmpty());
    EXPECT_FALSE(fs::exists(Set("a").string() + ".partial"));
  }
};

// Processes whose command line has a word of this set in it, without this one.
std::vector<pid_t> ProcessesOf(const fs::path& set) {
  std::vector<pid_t> found;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream file(entry.path() / "cmdline", std::ios::binary);
    const std::string words((std::istreambuf_iterator<char>(file)), {});
    if (words.find(set.string() + '\0') == std::string::npos) continue;
    const pid_t process = std::stoi(name);
    if (process != getpid()) found.push_back(process);
  }
  return found;
}

bool Within(std::chrono::seconds limit, const std::function<bool()>& holds) {
  const auto end = steady_clock::now() + limit;
  while (!holds()) {
    if (steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

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

// Workers end with it, however it ends, and what they had finished stays.
TEST_F(BatchFolder, KilledAtAnyMomentItGoesOnToTheSameBytes) {
  const auto begin = steady_clock::now();
  ASSERT_EQ(Begin().code, 0);
  const std::chrono::duration<double> whole = steady_clock::now() - begin;
  fs::remove_all(folder_ / "a");
  const auto expected = Undisturbed();
  Random random(11);
  constexpr int kKills = 6;
  for (int killed = 0; killed < kKills;) {
    const std::chrono::duration<double> after(random.Uniform(0, whole.count()));
    const auto start = steady_clock::now();
    const Interruption interruption{SIGKILL, [&] { return steady_clock::now() - start >= after; }};
    const Ran ran = fs::exists(Record())
                        ? DtrByItself({"batch", "resume", Set("a").string()}, interruption)
                        : Begin(interruption);
    EXPECT_TRUE(Within(std::chrono::seconds(10), [&] { return ProcessesOf(Set("a")).empty(); }))
        << "workers go on";
    if (ran.signal == SIGKILL) {
      ++killed;
      continue;
    }
    ASSERT_EQ(ran.code, 0) << ran.err;
    EXPECT_THAT(DifferingFiles(expected, Contents(Set("a"))), IsEmpty());
    fs::remove_all(folder_ / "a");
  }
  const Ran ran = fs::exists(Record()) ? Resume() : Begin();
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(DifferingFiles(expected, Contents(Set("a"))), IsEmpty());
  for (const auto& entry : fs::directory_iterator(folder_ / "a")) {
    EXPECT_TRUE(entry.path() == Set("a") || entry.path() == Folder()) << entry.path();
  }
}

}  // namespace
}  // namespace dtr::testing
