#include "pipeline/core/run/side_by_side.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "tests/support/on_threads.h"

namespace dtr::pipeline {
namespace {

// The most items that were at work at once, of 12 that take 1 GB each.
int AtOnce(double memory_gb) {
  SilentProgress silent;
  std::atomic<int> at_work = 0, most = 0;
  SideBySide(
      12, "", memory_gb, [](size_t) { return 1e9; }, silent,
      [&](size_t) {
        const int now = ++at_work;
        for (int seen = most; seen < now && !most.compare_exchange_weak(seen, now);) {
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        --at_work;
      });
  return most;
}

TEST(SideBySide, AsManyAsHalfOfTheMemoryHoldsAndOneAlways) {
  EXPECT_LE(OnThreads(8, [] { return AtOnce(4); }), 2);
  EXPECT_EQ(OnThreads(8, [] { return AtOnce(0.1); }), 1);
  EXPECT_EQ(OnThreads(1, [] { return AtOnce(0); }), 1);
  EXPECT_GE(OnThreads(4, [] { return AtOnce(0); }), 2);
}

class Heard : public Progress {
 public:
  void Stage(const std::string&, int total) override { total_ = total; }
  void Update(int done) override {
    done_.push_back(done);
    ++count_;
  }
  void Note(const std::string&) override {}
  bool StopRequested() const override { return count_ >= stop_after_; }

  int total_ = 0;
  std::atomic<int> count_ = 0;
  int stop_after_ = 1000;
  std::vector<int> done_;
};

TEST(SideBySide, TellsOfEachItemInRisingNumbersAndStopsBetweenThem) {
  const auto nothing = [](size_t) { return 0.0; };
  Heard heard;
  SideBySide(40, "work", 4, nothing, heard, [](size_t) {});
  EXPECT_EQ(heard.total_, 40);
  ASSERT_EQ(heard.done_.size(), 40U);
  EXPECT_TRUE(std::is_sorted(heard.done_.begin(), heard.done_.end()));
  Heard stopped;
  stopped.stop_after_ = 3;
  EXPECT_THROW(SideBySide(40, "work", 4, nothing, stopped, [](size_t) {}), Interrupted);
  EXPECT_EQ(stopped.done_.size(), 3U);
}

}  // namespace
}  // namespace dtr::pipeline
