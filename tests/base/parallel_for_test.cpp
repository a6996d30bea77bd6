#include "dtr/base/parallel_for.h"

#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "dtr/base/batches.h"

namespace dtr {
namespace {

void ForOn(int threads, int begin, int end, const std::function<void(int)>& body) {
  const ThreadLimit limit(threads);
  ParallelFor(begin, end, body);
}

TEST(ParallelFor, RunsEveryItemOnceForAnyNumberOfThreads) {
  for (const int threads : {1, 2, 7, 64}) {
    std::vector<std::atomic<int>> runs(1000);
    ForOn(threads, 0, 1000, [&](int i) { ++runs[static_cast<size_t>(i)]; });
    for (const auto& count : runs) ASSERT_EQ(count, 1) << threads << " threads";
  }
}

TEST(ParallelFor, EmptyAndReversedRangesRunNothing) {
  int runs = 0;
  ForOn(2, 5, 5, [&](int) { ++runs; });
  ForOn(2, 5, 3, [&](int) { ++runs; });
  EXPECT_EQ(runs, 0);
}

TEST(ParallelFor, RethrowsAnExceptionOfTheBody) {
  for (const int threads : {1, 4}) {
    EXPECT_THROW(ForOn(threads, 0, 100,
                       [](int i) {
                         if (i == 17) throw std::runtime_error("seventeen");
                       }),
                 std::runtime_error);
  }
}

TEST(ParallelFor, TheExceptionIsThatOfTheFirstItemThatThrewHoweverLoopsNest) {
  for (int run = 0; run < 20; ++run) {
    try {
      ForOn(4, 0, 8, [](int i) {
        ForOn(4, 0, 8, [i](int j) {
          if (j == 3) throw std::runtime_error(std::to_string(i));
        });
      });
      FAIL() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
      // Item 0 began before any other had ended, and it throws.
      EXPECT_STREQ(error.what(), "0");
    }
  }
}

// Waits until `wanted` threads are here, for a while; whether they came.
bool Meet(std::atomic<int>& here, int wanted) {
  using Clock = std::chrono::steady_clock;
  ++here;
  for (const auto end = Clock::now() + std::chrono::seconds(20); Clock::now() < end;) {
    if (here >= wanted) return true;
    std::this_thread::yield();
  }
  return false;
}

TEST(ParallelFor, LoopsInsideALoopShareItsThreads) {
  std::atomic<int> here{0}, met{0};
  ForOn(6, 0, 2, [&](int) {
    ForOn(6, 0, 3, [&](int) { met += Meet(here, 6); });  // six items, six threads
  });
  EXPECT_EQ(met, 6);
}

TEST(ParallelFor, NoMoreThreadsAtOnceThanTheLargestRequest) {
  ForOn(64, 0, 64, [](int) { std::this_thread::sleep_for(std::chrono::milliseconds(1)); });
  std::atomic<int> running{0}, most{0};
  for (int run = 0; run < 20; ++run) {
    ForOn(3, 0, 5, [&](int) {
      ForOn(3, 0, 40, [&](int) {
        const int now = ++running;
        for (int seen = most; seen < now && !most.compare_exchange_weak(seen, now);) {
        }
        std::this_thread::sleep_for(std::chrono::microseconds(50));
        --running;
      });
    });
  }
  EXPECT_LE(most, 5);  // a caller may wake in a loop whose place another took, for an item
  EXPECT_GE(most, 2);
}

TEST(ParallelFor, LoopsOneAfterTheOtherUseTheSameThreads) {
  std::mutex mutex;
  std::set<pid_t> threads;
  for (int run = 0; run < 200; ++run) {
    ForOn(4, 0, 8, [&](int) {
      const std::lock_guard lock(mutex);
      threads.insert(gettid());
    });
  }
  EXPECT_LE(threads.size(), 64U);  // other tests of this process started as many
}

TEST(ParallelFor, DeepNestsEnd) {
  std::atomic<int> leaves{0};
  ForOn(4, 0, 4, [&](int) {
    ForOn(4, 0, 4,
          [&](int) { ForOn(4, 0, 4, [&](int) { ForOn(4, 0, 4, [&](int) { ++leaves; }); }); });
  });
  EXPECT_EQ(leaves, 256);
}

TEST(ParallelFor, LoopsOfSeveralThreadsTakeNoThreadsFromEachOther) {
  std::atomic<int> here{0}, met{0};
  {
    std::vector<std::jthread> callers;
    for (int caller = 0; caller < 2; ++caller) {
      callers.emplace_back([&] { ForOn(2, 0, 2, [&](int) { met += Meet(here, 4); }); });
    }
  }
  EXPECT_EQ(met, 4);
}

TEST(ParallelFor, SeveralThreadsMayBeginLoopsAtOnce) {
  std::atomic<int> items{0};
  {
    std::vector<std::jthread> callers;
    for (int caller = 0; caller < 4; ++caller) {
      callers.emplace_back([&] {
        for (int run = 0; run < 50; ++run) ForOn(4, 0, 20, [&](int) { ++items; });
      });
    }
  }
  EXPECT_EQ(items, 4 * 50 * 20);
}

// As Python's multiprocessing does by default on Linux.
TEST(ParallelFor, AForkedProcessHasThreadsOfItsOwn) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "ThreadSanitizer starts no threads after a fork";
#endif
  ForOn(4, 0, 8, [](int) {});
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    std::atomic<int> here{0}, met{0};
    ForOn(3, 0, 3, [&](int) { met += Meet(here, 3); });
    _exit(met == 3 ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
}

TEST(Batches, AreAsLargeAsThreadsAndBytesAllowAndNothingIsLeft) {
  const ThreadLimit limit(3);
  for (const auto& [most_bytes, at_once] : {std::pair{100.0, 3}, {25.0, 2}, {1.0, 1}}) {
    std::atomic<int> done{0};
    Batches<int> batches(10, most_bytes, [&](int& item) { done += item; });
    for (int added = 1; added <= 7; ++added) {
      batches.Add(1);
      EXPECT_EQ(done, added / at_once * at_once) << most_bytes;
    }
    batches.Finish();
    EXPECT_EQ(done, 7);
  }
}

TEST(ThreadLimit, HoldsUntilItGoesAndInTheLoopsInside) {
  const int all = ThreadLimit::Current();
  EXPECT_GE(all, 1);
  const ThreadLimit three(3);
  {
    const ThreadLimit one(1);
    EXPECT_EQ(ThreadLimit::Current(), 1);
    const ThreadLimit every(0);
    EXPECT_EQ(ThreadLimit::Current(), all);
  }
  std::atomic<int> right{0};
  ParallelFor(0, 50, [&](int) { right += ThreadLimit::Current() == 3; });
  EXPECT_EQ(right, 50);
  std::jthread([&] { EXPECT_EQ(ThreadLimit::Current(), all); });  // its own
}

TEST(ParallelFor, NoMoreItemsAtOnceThanAskedForAndAllThreadsInsideThem) {
  std::atomic<int> here{0}, met{0}, at_once{0}, most{0};
  const ThreadLimit limit(4);
  ParallelFor(0, 6, 2, [&](int) {
    most = std::max(most.load(), ++at_once);
    EXPECT_EQ(ThreadLimit::Current(), 4);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    --at_once;
  });
  EXPECT_LE(most, 2);
  ParallelFor(0, 2, 1, [&](int) { ParallelFor(0, 4, [&](int) { met += Meet(here, 4); }); });
  EXPECT_GE(met, 4);
}

}  // namespace
}  // namespace dtr
