// `dtr batch` that is killed at random moments and begun again until it is done.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <thread>

#include "dtr/base/random.h"
#include "tests/cli/small_batch.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using std::chrono::steady_clock;
using ::testing::IsEmpty;

constexpr char kParts[] = "3";

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

// Workers end with it, however it ends, and what they had finished stays.
TEST_F(BatchFolder, KilledAtAnyMomentItGoesOnToTheSameBytes) {
  const auto begin = steady_clock::now();
  ASSERT_EQ(Begin({}, kParts).code, 0);
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
                        : Begin(interruption, kParts);
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
  const Ran ran = fs::exists(Record()) ? Resume() : Begin({}, kParts);
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(DifferingFiles(expected, Contents(Set("a"))), IsEmpty());
  for (const auto& entry : fs::directory_iterator(folder_ / "a")) {
    EXPECT_TRUE(entry.path() == Set("a") || entry.path() == Folder()) << entry.path();
  }
}

}  // namespace
}  // namespace dtr::testing
