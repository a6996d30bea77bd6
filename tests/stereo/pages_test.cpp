#include "stereo/pages.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "dtr/base/parallel_for.h"
#include "tests/support/on_threads.h"

namespace dtr::stereo {
namespace {

PageKey Planes(int view, int pass = 0) { return {PageKey::Kind::kPlanes, pass, view}; }

class PagesTest : public ::testing::Test {
 protected:
  std::shared_ptr<const int> Get(Pages& pages, int view, std::uint64_t bytes = 10) {
    return pages.Get<int>(Planes(view), bytes, [&] {
      loaded.push_back(view);
      return std::make_shared<const int>(view);
    });
  }
  std::vector<int> loaded;
};

TEST_F(PagesTest, WhatWasUsedTheLongestAgoMakesRoom) {
  Pages pages(40);  // three pages, and one more on its way
  for (const int view : {0, 1, 2}) Get(pages, view);
  EXPECT_EQ(*Get(pages, 0), 0);  // still there, and now used later than 1
  Get(pages, 3);
  loaded.clear();
  for (const int view : {0, 2, 3}) Get(pages, view);
  EXPECT_TRUE(loaded.empty());
  Get(pages, 1);
  EXPECT_EQ(loaded, std::vector<int>{1});
  EXPECT_EQ(pages.held(), 30u);
}

TEST_F(PagesTest, WhatIsInUseStaysAndIsNeverExceeded) {
  Pages pages(30);
  const auto a = Get(pages, 0), b = Get(pages, 1);
  EXPECT_THROW(Get(pages, 2), std::logic_error);
  EXPECT_EQ(pages.held(), 20u);
  loaded.clear();
  Get(pages, 0);
  EXPECT_TRUE(loaded.empty());
}

TEST_F(PagesTest, WorkTakesRoomAsLongAsItIsReserved) {
  Pages pages(40);
  Get(pages, 0);
  Get(pages, 1);
  {
    const Pages::Reservation work(pages, 25);
    EXPECT_EQ(pages.held(), 35u);  // one page had to go
    EXPECT_THROW(Pages::Reservation(pages, 41), std::logic_error);
  }
  EXPECT_LE(pages.held(), 10u);
  EXPECT_LE(pages.peak(), 40u);
}

TEST_F(PagesTest, DroppedPagesAreLoadedAnew) {
  Pages pages(100);
  Get(pages, 0);
  Get(pages, 1);
  pages.Drop([](const PageKey& key) { return key.view == 0; });
  EXPECT_EQ(pages.held(), 10u);
  loaded.clear();
  Get(pages, 1);
  Get(pages, 0);
  EXPECT_EQ(loaded, std::vector<int>{0});
}

TEST_F(PagesTest, SeveralThreadsLoadAPageOnceAndWhatFailedAgain) {
  Pages pages(1000);
  std::atomic<int> loads{0}, failures{0};
  const auto get = [&](int i) {
    const int view = i % 5;
    try {
      const auto page = pages.Get<int>({PageKey::Kind::kPixels, 0, view}, 10, [&] {
        if (loads++ == 0) throw std::runtime_error("the first one fails");
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        return std::make_shared<const int>(view);
      });
      EXPECT_EQ(*page, view);
    } catch (const std::runtime_error&) {
      ++failures;
    }
  };
  OnThreads(8, [&] { return ParallelFor(0, 40, get); });
  EXPECT_EQ(failures, 1);
  EXPECT_EQ(loads, 6);
  EXPECT_EQ(pages.held(), 50u);
}

}  // namespace
}  // namespace dtr::stereo
