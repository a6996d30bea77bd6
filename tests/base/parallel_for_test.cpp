#include "dtr/base/parallel_for.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

namespace dtr {
namespace {

TEST(ParallelFor, RunsEveryItemOnceForAnyNumberOfThreads) {
  for (const int threads : {1, 2, 7, 64}) {
    std::vector<std::atomic<int>> runs(1000);
    ParallelFor(0, 1000, threads, [&](int i) { ++runs[static_cast<size_t>(i)]; });
    for (const auto& count : runs) ASSERT_EQ(count, 1) << threads << " threads";
  }
}

TEST(ParallelFor, EmptyAndReversedRangesRunNothing) {
  int runs = 0;
  ParallelFor(5, 5, 2, [&](int) { ++runs; });
  ParallelFor(5, 3, 2, [&](int) { ++runs; });
  EXPECT_EQ(runs, 0);
}

TEST(ParallelFor, RethrowsAnExceptionOfTheBody) {
  for (const int threads : {1, 4}) {
    EXPECT_THROW(ParallelFor(0, 100, threads,
                             [](int i) {
                               if (i == 17) throw std::runtime_error("seventeen");
                             }),
                 std::runtime_error);
  }
}

TEST(ResolveThreads, PositiveIsKeptAndZeroMeansAllCores) {
  EXPECT_EQ(ResolveThreads(3), 3);
  EXPECT_GE(ResolveThreads(0), 1);
}

}  // namespace
}  // namespace dtr
