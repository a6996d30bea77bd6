// Commands that are killed at random moments and begun again until they are done: the set has the
// bytes of an undisturbed run, and nothing lies beside it. Builds of photos: resume_test.cpp.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>

#include "dtr/base/process.h"
#include "dtr/base/random.h"
#include "tests/cli/courtyard_and_set.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using std::chrono::steady_clock;
using ::testing::IsEmpty;
using Words = std::vector<std::string>;

class Killed : public CourtyardAndSet {
 protected:
  // `command` makes the set that it is given.
  void KillAndFinish(const std::function<Words(const std::string&)>& command, int kills,
                     std::uint64_t seed) {
    const auto begin = steady_clock::now();
    fs::create_directories(folder_ / "undisturbed");
    DtrOk(command(In("undisturbed/set.dtr")));
    const std::chrono::duration<double> whole = steady_clock::now() - begin;
    const auto expected = Contents(folder_ / "undisturbed");
    fs::create_directories(folder_ / "killed");
    const Words words = command(In("killed/set.dtr"));
    Random random(seed);
    for (int killed = 0; killed < kills;) {
      const std::chrono::duration<double> after(random.Uniform(0, whole.count()));
      const auto start = steady_clock::now();
      const Ran ran = Dtr(words, {SIGKILL, [&] { return steady_clock::now() - start >= after; }});
      if (ran.signal == SIGKILL) {
        ++killed;
        if (!fs::exists(In("killed/set.dtr"))) continue;
        // In the moment after its last rename, which the next run finds.
        ExpectRejected(Dtr(words), 2, "expected no such folder yet, found one");
      } else {
        ASSERT_EQ(ran.code, 0) << ran.err;
      }
      EXPECT_THAT(DifferingFiles(expected, Contents(folder_ / "killed")), IsEmpty());
      fs::remove_all(In("killed/set.dtr"));
    }
    DtrOk(words);
    EXPECT_THAT(DifferingFiles(expected, Contents(folder_ / "killed")), IsEmpty());
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "killed"), fs::directory_iterator()),
              1);
  }
  static constexpr int kKills = 12;
};

TEST_F(Killed, Pruning) {
  const auto prune = [&](const std::string& set) {
    return Words{
        "prune", Shared("good.dtr"), "-o", set, "--max-loss-db", "1", "--probes", "3", "--checks",
        "3",     "--renderer",       "cpu"};
  };
  KillAndFinish(prune, kKills, 5);
}

TEST_F(Killed, ADynamicBuildOfPhotos) {
  DtrOk({"dataset", "make", "toys", "-o", In("toys"), "--views", "4", "--steps", "3", "--width",
         "120", "--height", "80", "--noise", "1", "--supersampling", "1"});
  const auto build = [&](const std::string& set) {
    return Words{
        "build",     In("toys/photos"), "--dynamic", "--rig", In("toys/rig.json"), "-o", set,
        "--holdout", "cam02",           "--preset",  "fast",  "--passes",          "1"};
  };
  KillAndFinish(build, kKills, 6);
}

TEST_F(Killed, ADynamicBuildOfVideosThatStoresVideos) {
  if (FindProgram("ffmpeg").empty()) GTEST_SKIP() << "SKIPPED: ffmpeg is absent";
  DtrOk({"dataset", "make", "toys", "-o", In("toys"), "--views", "4", "--steps", "3", "--width",
         "120", "--height", "80", "--noise", "1", "--supersampling", "1", "--videos"});
  const auto build = [&](const std::string& set) {
    return Words{"build",
                 In("toys/videos"),
                 "--dynamic",
                 "--rig",
                 In("toys/rig.json"),
                 "-o",
                 set,
                 "--preset",
                 "fast",
                 "--passes",
                 "1",
                 "--no-completion",
                 "--video",
                 "lossless"};
  };
  KillAndFinish(build, kKills, 7);
}

}  // namespace
}  // namespace dtr::testing
