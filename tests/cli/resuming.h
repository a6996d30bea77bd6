// tests/cli/resuming.h -- builds that are stopped, by a signal or a full disk, and must be finished
// by the same command to the bytes of an undisturbed run.
#pragma once
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <fstream>
#include <set>
#include <sstream>

#include "dtr/base/random.h"
#include "dtr/io/image_io.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/small_disk.h"
#include "tests/support/test_data.h"

namespace dtr::testing {

inline double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

class Resuming : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_NO_FATAL_FAILURE(MakeInputs());
    if (IsSkipped()) return;
    const auto start = std::chrono::steady_clock::now();
    DtrOk(Arguments(Set("undisturbed")));
    undisturbed_s_ = SecondsSince(start);
    expected_ = Contents(Set("undisturbed"));
  }
  // Known cameras: SfM's model is the checkpoint that such a run begins with. One photo has a mask.
  virtual void MakeInputs() {
    MakeSmallCourtyard(folder_.path() / "courtyard");
    Mask mask(kCourtyardWidthPx, kCourtyardHeightPx, 1, 255);
    for (int y = 20; y < 60; ++y) {
      for (int x = 40; x < 100; ++x) mask(x, y) = 0;
    }
    io::WriteMask(folder_ / "courtyard/images/0001_mask.png", mask);
  }
  // What a set is built from.
  virtual std::vector<std::string> Inputs() const {
    const std::filesystem::path courtyard = folder_ / "courtyard";
    return {(courtyard / "images").string(), "--poses", (courtyard / "sparse").string()};
  }
  // A set called set.dtr in a folder of its own: the report's title is the set's name.
  std::filesystem::path Set(const std::string& run) const {
    std::filesystem::create_directories(folder_ / run);
    return folder_ / run / "set.dtr";
  }
  std::vector<std::string> Arguments(const std::filesystem::path& set) const {
    std::vector<std::string> arguments = Inputs();
    arguments.insert(arguments.begin(), "build");
    // As little work as every stage can be made of: many runs are made.
    for (const char* word :
         {"--holdout", "every:4", "--depth-error", "0.25", "--max-size", "96", "--neighbours", "2",
          "--pass-neighbours", "2", "--iterations", "1", "--passes", "1", "--threads", "1"}) {
      arguments.emplace_back(word);
    }
    arguments.insert(arguments.end(), {"-o", set.string()});
    return arguments;
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
        if (!std::filesystem::exists(set)) continue;
        // In the moment after its last rename: the set is whole, which the next run says and clears
        // away what lies beside it.
        ExpectRejected(Dtr(Arguments(set)), 2, "expected no such folder yet, found one");
        ExpectFinished(set);
        std::filesystem::remove_all(set);
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

class FullDisk : public Resuming {
 protected:
  // Room grows by `step_kib` whenever the run stopped for want of it, until it is finished.
  void GrowUntilFinished(long step_kib, int min_stops) {
    const std::filesystem::path disk_folder = folder_ / "disk";
    const SmallDisk disk(disk_folder);
    if (!disk.mounted()) GTEST_SKIP() << "SKIPPED: no file system can be mounted here";
    const std::filesystem::path set = disk_folder / "set.dtr";
    int stops = 0;
    constexpr int kMaxStops = 400;
    for (long kib = 64; stops < kMaxStops; kib += step_kib) {
      disk.Grow(kib);
      const Ran ran = Dtr(Arguments(set));
      if (ran.code == 0) break;
      ++stops;
      ExpectRejected(ran, 1, "No space left on device");
      EXPECT_FALSE(std::filesystem::exists(set)) << kib;
      ExpectNoTemporaryFiles(set.string() + ".partial");
      stopped_in_[LastStage(ran)].insert(PartNamed(ran, set));
    }
    EXPECT_GE(stops, min_stops);
    ExpectFinished(set);
  }
  // The disk is full once a file lies in `part` of the set in the making; with room it is finished.
  void FillAt(const std::string& part) {
    const std::filesystem::path disk_folder = folder_ / ("full_" + part);
    const SmallDisk disk(disk_folder);
    if (!disk.mounted()) GTEST_SKIP() << "SKIPPED: no file system can be mounted here";
    constexpr long kRoomKib = 64 << 10;
    disk.Grow(kRoomKib);
    const std::filesystem::path set = disk_folder / "set.dtr";
    bool full = false;
    const Ran ran =
        Dtr(Arguments(set), {SIGKILL, [&] {
                               if (!full && FilesIn(set.string() + ".partial/" + part)) {
                                 disk.Fill();
                                 full = true;
                               }
                               return false;
                             }});
    ExpectRejected(ran, 1, "No space left on device");
    EXPECT_FALSE(std::filesystem::exists(set));
    ExpectNoTemporaryFiles(set.string() + ".partial");
    stopped_in_[LastStage(ran)].insert(PartNamed(ran, set));
    disk.Grow(kRoomKib);
    DtrOk(Arguments(set));
    ExpectFinished(set);
  }
  static void ExpectNoTemporaryFiles(const std::filesystem::path& folder) {
    if (!std::filesystem::exists(folder)) return;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
      EXPECT_EQ(entry.path().filename().string().find(".tmp"), std::string::npos) << entry.path();
    }
  }

  // Where those runs stopped: the stage that was told last, and what could not be written.
  std::map<std::string, std::set<std::string>> stopped_in_;

 private:
  static std::string LastStage(const Ran& ran) {
    std::istringstream lines(ran.err);
    std::string stage = "none";
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("== ")) stage = line.substr(3);
    }
    return stage;
  }
  // "depth" of "dtr: .../set.dtr.partial/depth/0003.png: cannot be ...": the first name below it.
  static std::string PartNamed(const Ran& ran, const std::filesystem::path& set) {
    const std::vector<std::string> lines = ran.ErrorLines();
    const std::string below = set.string() + ".partial/";
    const size_t at = lines.empty() ? std::string::npos : lines[0].find(below);
    if (at == std::string::npos) return "none";
    const std::string rest = lines[0].substr(at + below.size());
    return rest.substr(0, rest.find_first_of("/:"));
  }
};

}  // namespace dtr::testing
