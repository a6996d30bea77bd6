#include "dtr/types/photo_names.h"

#include <gmock/gmock.h>

namespace dtr {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(PhotosCalled, AnExactNameIsThatPhotoAndAStemIsEveryPhotoOfIt) {
  const std::vector<std::string> names = {"a/IMG.jpg", "a/IMG.png", "b/IMG.jpg", "c", "c.jpg"};
  EXPECT_THAT(PhotosCalled(names, "a/IMG.png"), ElementsAre(1));
  EXPECT_THAT(PhotosCalled(names, "a/IMG"), ElementsAre(0, 1));
  EXPECT_THAT(PhotosCalled(names, "b/IMG"), ElementsAre(2));
  EXPECT_THAT(PhotosCalled(names, "c"), ElementsAre(3)) << "exactly so";
  EXPECT_THAT(PhotosCalled(names, "IMG"), IsEmpty());
}

}  // namespace
}  // namespace dtr
