#include "dtr/base/huge_pages.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <numeric>

namespace dtr {
namespace {

// Below half a page, at its border, with a last page that is nearly empty and one nearly full.
TEST(HugeVector, HoldsWhatAVectorHolds) {
  constexpr size_t kPage = size_t{1} << 21;
  for (const size_t bytes :
       {size_t{1}, kPage / 2 - 1, kPage / 2, kPage, kPage + 1, 2 * kPage - 1}) {
    HugeVector<std::uint8_t> huge(bytes);
    std::iota(huge.begin(), huge.end(), std::uint8_t{3});
    const HugeVector<std::uint8_t> copy = huge;
    huge.resize(bytes + kPage);
    EXPECT_TRUE(std::equal(copy.begin(), copy.end(), huge.begin())) << bytes;
    EXPECT_EQ(huge.back(), 0);
    if (bytes >= kPage / 2) {
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(copy.data()) % kPage, 0u);
    }
    const HugeVector<std::uint8_t> moved = std::move(huge);
    EXPECT_EQ(moved[bytes - 1], copy.back());
  }
  EXPECT_THROW(HugePageAllocator<double>().allocate(static_cast<size_t>(-1) / 4),
               std::bad_array_new_length);
}

}  // namespace
}  // namespace dtr
