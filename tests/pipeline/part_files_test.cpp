#include "pipeline/build/detail/part_files.h"

#include <gtest/gtest.h>

#include "tests/support/test_data.h"

namespace dtr::pipeline {
namespace {

TEST(DoneParts, TheirCostIsThatOfTheirStages) {
  const testing::TemporaryFolder folder;
  const auto set = folder / "a.dtr", work = io::SetWriter::WorkFolderOf(set);
  EXPECT_FALSE(HasParts(work));
  EXPECT_EQ(TotalOf(work, "search").cpu_s, 0);
  WriteDonePart(work, {"search", {0, 2}}, {1, 10});
  WriteDonePart(work, {"search", {1, 2}}, {2, 20});
  WriteDonePart(work, {"pass-1", {0, 1}}, {4, 40});
  WriteDonePart(work, {"pass-12", {2, 3}}, {8, 80});
  EXPECT_TRUE(HasParts(work));
  EXPECT_EQ(TotalOf(work, "search").cpu_s, 30);
  EXPECT_EQ(TotalOf(work, "search").wall_s, 3);
  EXPECT_EQ(TotalOf(work, "pass-1").cpu_s, 40);
  EXPECT_EQ(TotalOf(work, "pass-12").wall_s, 8);
  EXPECT_EQ(TotalOf(work, "maps").wall_s, 0);
  EXPECT_EQ(FindDonePart(set, {"search", {1, 2}})->cpu_s, 20);
  EXPECT_FALSE(FindDonePart(set, {"search", {1, 3}}));
}

}  // namespace
}  // namespace dtr::pipeline
