// tests/cli/resuming.h -- builds that are stopped, by a signal or a full disk, and must be finished
// by the same command to the bytes of an undisturbed run.
#pragma once
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>

#include <chrono>
#include <fstream>

#include "dtr/base/random.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {

inline double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

class Resuming : public ::testing::Test {
 protected:
  // Known cameras: SfM's model is the checkpoint that such a run begins with.
  void SetUp() override {
    MakeSmallCourtyard(folder_.path() / "courtyard");
    const auto start = std::chrono::steady_clock::now();
    DtrOk(Arguments(Set("undisturbed")));
    undisturbed_s_ = SecondsSince(start);
    expected_ = Contents(Set("undisturbed"));
  }
  // A set called set.dtr in a folder of its own: the report's title is the set's name.
  std::filesystem::path Set(const std::string& run) const {
    std::filesystem::create_directories(folder_ / run);
    return folder_ / run / "set.dtr";
  }
  std::vector<std::string> Arguments(const std::filesystem::path& set) const {
    const std::filesystem::path courtyard = folder_ / "courtyard";
    return {"build",     (courtyard / "images").string(),
            "-o",        set.string(),
            "--poses",   (courtyard / "sparse").string(),
            // As little work as every stage can be made of: many runs are made.
            "--max-size",
            "96",
            "--neighbours",
            "2",
            "--round-neighbours",
            "2",
            "--iterations",
            "1",
            "--rounds",
            "1",
            "--threads", "1"};
  }
  // The set as it must be, and nothing beside it.
  void ExpectFinished(const std::filesystem::path& set) const {
    EXPECT_THAT(DifferingFiles(expected_, Contents(set)), ::testing::IsEmpty());
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(set.parent_path()),
                            std::filesystem::directory_iterator()),
              1);
  }
  // Kills runs at random moments until `kills` of them were hit, and lets the next one finish.
  void KillAndFinish(const std::string& name, int kills, std::uint64_t seed) {
    Random random(seed);
    const std::filesystem::path set = Set(name);
    for (int killed = 0; killed < kills;) {
      const double after_s = random.Uniform(0, undisturbed_s_);
      const auto start = std::chrono::steady_clock::now();
      const Ran ran =
          Dtr(Arguments(set), {SIGKILL, [&] { return SecondsSince(start) >= after_s; }});
      if (ran.signal == SIGKILL) {
        ++killed;
        continue;
      }
      ASSERT_EQ(ran.code, 0) << ran.err;
      ExpectFinished(set);  // it was faster; once more from the start
      std::filesystem::remove_all(set);
    }
    DtrOk(Arguments(set));
    ExpectFinished(set);
  }

  TemporaryFolder folder_;
  std::map<std::string, std::string> expected_;
  double undisturbed_s_ = 0;
};

/// A file system of some bytes in memory, seen by this process and its children only.
class SmallDisk {
 public:
  explicit SmallDisk(const std::filesystem::path& folder) : folder_(folder) {
    std::filesystem::create_directories(folder);
    mounted_ = unshare(CLONE_NEWNS) == 0 &&
               mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
               mount("tmpfs", folder.c_str(), "tmpfs", 0, "size=64k") == 0;
  }
  ~SmallDisk() {
    if (mounted_) umount(folder_.c_str());
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  bool mounted() const { return mounted_; }
  void Grow(long kib) const {
    const std::string size = "size=" + std::to_string(kib) + "k";
    ASSERT_EQ(mount("tmpfs", folder_.c_str(), "tmpfs", MS_REMOUNT, size.c_str()), 0);
  }

 private:
  std::filesystem::path folder_;
  bool mounted_ = false;
};

class FullDisk : public Resuming {
 protected:
  // Room grows by `step_kib` whenever the run stopped for want of it, until it is finished.
  void GrowUntilFinished(long step_kib, int least_stops) {
    const std::filesystem::path disk_folder = folder_ / "disk";
    const SmallDisk disk(disk_folder);
    if (!disk.mounted()) GTEST_SKIP() << "SKIPPED: no file system can be mounted here";
    const std::filesystem::path set = disk_folder / "set.dtr";
    int stops = 0;
    constexpr int kMostStops = 400;
    for (long kib = 64; stops < kMostStops; kib += step_kib) {
      disk.Grow(kib);
      const Ran ran = Dtr(Arguments(set));
      if (ran.code == 0) break;
      ++stops;
      ExpectRefused(ran, 1, "No space left on device");
      EXPECT_FALSE(std::filesystem::exists(set)) << kib;
      ExpectNoTemporaryFiles(set.string() + ".partial");
    }
    EXPECT_GE(stops, least_stops);
    ExpectFinished(set);
  }
  static void ExpectNoTemporaryFiles(const std::filesystem::path& folder) {
    if (!std::filesystem::exists(folder)) return;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
      EXPECT_EQ(entry.path().filename().string().find(".tmp"), std::string::npos) << entry.path();
    }
  }
};

}  // namespace dtr::testing
