#include "viewer/sigma_cache.h"

#include <gtest/gtest.h>

#include <string>

namespace dtr::viewer {
namespace {

TEST(SigmaCache, KeepsThoseOfThePictureAndReadsEachOnce) {
  View views[4];
  for (int i = 0; i < 4; ++i) views[i].id = std::string(1, static_cast<char>('a' + i));
  std::string read;
  SigmaCache cache([&](const View& view) {
    read += view.id;
    return Grid<float>(2, 1, 1, static_cast<float>(view.id[0]));
  });
  const std::set<const View*> first{&views[0], &views[1]}, second{&views[1], &views[2]};
  for (int repeat = 0; repeat < 2; ++repeat) {
    for (const View* view : first) EXPECT_EQ((*cache.Of(*view, first))(0, 0), view->id[0]);
  }
  EXPECT_EQ(cache.size(), 2u);
  const Grid<float>* const kept = cache.Of(views[1], second);
  EXPECT_EQ(kept, cache.Of(views[1], second));
  cache.Of(views[2], second);
  EXPECT_EQ(cache.size(), 2u) << "the first view's went";
  EXPECT_EQ((*kept)(0, 0), 'b') << "an image's own stay where they are";
  for (int i = 0; i < 4; ++i) cache.Of(views[i], {&views[i]});
  EXPECT_EQ(cache.size(), 1u);
  EXPECT_EQ(read, "abcabcd");
}

}  // namespace
}  // namespace dtr::viewer
