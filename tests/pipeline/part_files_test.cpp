#include "pipeline/build/detail/part_files.h"

#include <gtest/gtest.h>

#include "tests/support/test_data.h"

namespace dtr::pipeline {
namespace {

TEST(DoneParts, TheirCostIsThatOfTheirStages) {
  const testing::TemporaryFolder work;
  EXPECT_EQ(TotalOf(work.path(), {"search"}).cpu_s, 0);
  WriteDonePart(work.path(), {"search", {0, 2}}, {1, 10});
  WriteDonePart(work.path(), {"search", {1, 2}}, {2, 20});
  WriteDonePart(work.path(), {"pass-1", {0, 1}}, {4, 40});
  WriteDonePart(work.path(), {"pass-12", {2, 3}}, {8, 80});
  EXPECT_EQ(TotalOf(work.path(), {"search"}).cpu_s, 30);
  EXPECT_EQ(TotalOf(work.path(), {"search"}).wall_s, 3);
  EXPECT_EQ(TotalOf(work.path(), {"pass"}).cpu_s, 120);
  EXPECT_EQ(TotalOf(work.path(), {"maps", "pass"}).wall_s, 12);
  EXPECT_EQ(ReadDonePart(work.path(), {"search", {1, 2}})->cpu_s, 20);
  EXPECT_FALSE(ReadDonePart(work.path(), {"search", {1, 3}}));
}

}  // namespace
}  // namespace dtr::pipeline
