#include "dtr/render/shrunk_photos.h"

#include <gtest/gtest.h>

#include <thread>

#include "dtr/render/colour.h"
#include "dtr/render/exposure.h"

namespace dtr {
namespace {

View PhotoOf(std::uint8_t level) {
  View view;
  view.image = ImageRgb8(20, 10, 3, level);
  return view;
}

double LightOf(const ShrunkPhoto& photo) { return photo.light(0, 0, 0); }

TEST(ShrunkPhotos, AverageUsablePixelsOfACellAndApplyTheGain) {
  View view = PhotoOf(100);
  view.mask = Mask(20, 10, 1, 255);
  view.gain = {1, 0.5, 100};
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      view.mask(x, y) = x < 4 ? 0 : 255;
      if (x < 4) view.image(x, y, 0) = 7;
      view.mask(x + 8, y) = 0;
    }
  }
  ShrunkPhotos photos;
  const auto made = photos.Of({&view}, 8, 1);
  const ShrunkPhoto& photo = *made.front();
  ASSERT_EQ(photo.light.width(), 3);  // the last cells hold what is left
  ASSERT_EQ(photo.light.height(), 2);
  const double linear = LinearFromSrgb(100 / 255.0);
  EXPECT_DOUBLE_EQ(photo.light(0, 0, 0), linear);
  EXPECT_DOUBLE_EQ(photo.light(0, 0, 1), Exposed(linear, 0.5));
  EXPECT_DOUBLE_EQ(photo.light(0, 0, 2), Exposed(linear, 100));
  EXPECT_NE(photo.usable(0, 0), 0);
  EXPECT_EQ(photo.usable(1, 0), 0);
  EXPECT_DOUBLE_EQ(photo.light(2, 1, 0), linear);
}

TEST(ShrunkPhotos, AreMadeOnceAndAnewWhereSomethingElseIsAskedFor) {
  View a = PhotoOf(10), b = PhotoOf(20);
  ShrunkPhotos photos;
  const auto first = photos.Of({&a, &b}, 8, 2);
  EXPECT_EQ(photos.Of({&b, &a}, 8, 2), (decltype(first){first[1], first[0]}));
  EXPECT_NE(photos.Of({&a}, 5, 1), photos.Of({&a}, 8, 1));
  EXPECT_EQ(photos.Of({&a}, 8, 1).front(), first.front());
  const ImageRgb8 kept = std::exchange(a.image, PhotoOf(90).image);  // its bytes stay in use
  EXPECT_DOUBLE_EQ(LightOf(*photos.Of({&a}, 8, 1).front()), LinearFromSrgb(90 / 255.0));
  b.image_file = StoredFile{"b.jpg", "0123", 9};
  const auto hashed = photos.Of({&b}, 8, 1);
  EXPECT_NE(hashed.front(), first[1]);
  photos.Clear();
  EXPECT_NE(photos.Of({&b}, 8, 1), hashed);
}

TEST(ShrunkPhotos, ThoseAskedForLongestAgoAreForgotten) {
  std::vector<View> views;
  for (std::uint8_t i = 0; i < 6; ++i) views.push_back(PhotoOf(i));
  constexpr size_t kPhotoBytes = 3 * 2 * (3 * sizeof(double) + 1);  // cells of 20x10 px
  ShrunkPhotos photos(5 * kPhotoBytes);
  std::vector<std::weak_ptr<const ShrunkPhoto>> made;
  for (const View& view : views) made.push_back(photos.Of({&view}, 8, 1).front());
  EXPECT_TRUE(made.front().expired());
  for (size_t i = 1; i < made.size(); ++i) EXPECT_FALSE(made[i].expired()) << i;
  // What one image needs is kept even where it is too much.
  ShrunkPhotos small(kPhotoBytes);
  std::vector<const View*> all;
  for (const View& view : views) all.push_back(&view);
  const auto first = small.Of(all, 8, 2);
  EXPECT_EQ(small.Of(all, 8, 2), first);
}

TEST(ShrunkPhotos, SeveralThreadsMayAsk) {
  std::vector<View> views;
  for (int i = 0; i < 80; ++i) views.push_back(PhotoOf(static_cast<std::uint8_t>(3 * i)));
  ShrunkPhotos photos;
  const auto ask = [&](int step) {
    for (int k = 0; k < 400; ++k) {
      const size_t i = static_cast<size_t>(k * step) % views.size();
      const double expected = LinearFromSrgb(3 * static_cast<int>(i) / 255.0);
      ASSERT_DOUBLE_EQ(LightOf(*photos.Of({&views[i]}, 8, 1).front()), expected);
    }
  };
  std::jthread other(ask, 7);
  ask(3);
}

}  // namespace
}  // namespace dtr
