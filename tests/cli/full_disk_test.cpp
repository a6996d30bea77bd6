// A full disk under every command that writes, besides `dtr build` (resume_test): one line says so,
// what was there stays, and with room the same command makes what it would have made at once.
#include <gtest/gtest.h>
#include <sys/statvfs.h>

#include <algorithm>

#include "tests/cli/writing_commands.h"
#include "tests/support/small_disk.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

class FullDiskOf : public WritingCommandTest {
 protected:
  // The files that bear their own names: work in progress, and what says that it is, are left out.
  static std::map<std::string, std::string> Whole(const fs::path& folder) {
    std::map<std::string, std::string> whole = Contents(folder);
    std::erase_if(whole, [](const auto& item) {
      return item.first.find(".partial/") != std::string::npos || item.first.ends_with(".lock");
    });
    return whole;
  }
  // What was there is as it was; what is new is allowed to be, and whole.
  static void ExpectNothingLostOrHalf(const std::map<std::string, std::string>& before,
                                      const std::map<std::string, std::string>& expected,
                                      const std::map<std::string, std::string>& now) {
    for (const std::string& name : DifferingFiles(before, now)) {
      const std::string& place = GetParam().one_by_one;
      const bool allowed = !place.empty() && name.starts_with(place);
      EXPECT_TRUE(allowed) << name;
      if (!allowed || !GetParam().repeats) continue;
      const auto whole = expected.find(name), found = now.find(name);
      EXPECT_TRUE(whole != expected.end() && found != now.end() && *whole == *found) << name;
    }
  }
};

long UsedKib(const fs::path& disk) {
  struct statvfs about;
  EXPECT_EQ(statvfs(disk.c_str(), &about), 0);
  return static_cast<long>((about.f_blocks - about.f_bfree) * about.f_frsize / 1024);
}

// Room in KiB beside what lies there from the start; a disk of none would be one without a limit.
constexpr long kRooms[] = {4, 16, 40, 100, 200, 400, 800, 1600, 64000};

TEST_P(FullDiskOf, IsSaidInOneLineLosesNothingAndRoomMakesItWhole) {
  if (LacksData()) GTEST_SKIP() << "SKIPPED: no " << DataFolder() / "chessboard_stereo_640x480";
  const fs::path plain = folder_ / "plain", full = folder_ / "disk";
  const SmallDisk disk(full);
  if (!disk.mounted()) GTEST_SKIP() << "SKIPPED: no file system can be mounted here";
  disk.Grow(kRooms[std::size(kRooms) - 1]);
  Prepare(plain);
  Prepare(full);
  EXPECT_TRUE(IsDone(Dtr(In(plain))));
  const auto expected = Contents(plain);
  const auto before = Whole(full);
  const long used_kib = UsedKib(full);
  int stops = 0;
  for (const long room_kib : kRooms) {
    disk.Grow(std::max(used_kib + room_kib, UsedKib(full)));
    const Ran ran = Dtr(In(full));
    if (IsDone(ran)) break;
    ++stops;
    ExpectRejected(ran, kFailed, "No space left on device");
    ExpectNothingLostOrHalf(before, expected, Whole(full));
  }
  EXPECT_GE(stops, GetParam().min_stops);
  const auto found = Contents(full);
  if (GetParam().repeats) {
    EXPECT_THAT(DifferingFiles(expected, found), ::testing::IsEmpty());
  }
  const auto names = [](const auto& contents) {
    std::vector<std::string> list;
    for (const auto& [name, content] : contents) list.push_back(name);
    return list;
  };
  EXPECT_EQ(names(found), names(expected));
}

INSTANTIATE_TEST_SUITE_P(, FullDiskOf, ::testing::ValuesIn(kWritingCommands),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace dtr::testing
