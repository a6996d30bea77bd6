#include "dtr/base/memory_budget.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "tests/support/on_threads.h"

namespace dtr {
namespace {

// The most that `threads` threads held at a time when each item takes `bytes`.
double MaxHeld(double room_gb, double bytes, int threads) {
  MemoryBudget budget(room_gb);
  std::atomic<int> held{0}, most{0};
  OnThreads(threads, [&] {
    return ParallelFor(0, 60, [&](int) {
      const auto share = budget.Take(bytes);
      const int now = ++held;
      for (int seen = most; now > seen && !most.compare_exchange_weak(seen, now);) {
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      --held;
    });
  });
  return most * bytes;
}

TEST(MemoryBudget, IsNeverExceeded) {
  EXPECT_LE(MaxHeld(1, 0.3e9, 8), 0.9e9);
  EXPECT_LE(MaxHeld(1, 0.9e9, 8), 0.9e9);
}

TEST(MemoryBudget, LetsThroughOneThatIsLargerThanAllOfIt) { EXPECT_EQ(MaxHeld(1, 5e9, 8), 5e9); }

TEST(MemoryBudget, WithoutABoundNobodyWaits) {
  MemoryBudget budget(0);
  const auto one = budget.Take(1e12);
  const auto two = budget.TakeForPhoto(1'000'000, 1'000'000);  // this thread would wait for ever
}

TEST(MemoryBudget, SharesOfManySizesAllComeThrough) {
  MemoryBudget budget(1);
  std::atomic<int> done{0};
  ParallelFor(0, 200, [&](int i) {
    const auto share = budget.Take(0.05e9 * (i % 30));
    ++done;
  });
  EXPECT_EQ(done, 200);
}

TEST(RequireMemory, RejectsWhatIsLargerThanAllOfItWithNeedAndLimit) {
  const auto ask = [](double bytes, double gb) { RequireMemory(bytes, gb, "a.gif", "shrink it"); };
  try {
    ask(3.2e9, 0.5);
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "a.gif takes 3.2 GB of memory, more than `memory` 0.5; shrink it");
  }
  EXPECT_NO_THROW(ask(0.5e9, 0.5));
  EXPECT_NO_THROW(ask(1e15, 0));                    // no bound
  EXPECT_NO_THROW(ask(kAlwaysAllowedBytes, 1e-6));  // the program itself takes as much
  EXPECT_THROW(ask(kAlwaysAllowedBytes + 1, 1e-6), Error);
}

}  // namespace
}  // namespace dtr
