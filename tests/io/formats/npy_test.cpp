#include "dtr/io/formats/npy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>

#include "dtr/base/error.h"

namespace dtr::io {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A .npy file as numpy writes it, with this header and these values.
template <typename Float>
std::string File(const std::string& dictionary, const std::vector<Float>& values,
                 bool big_endian = false, int version = 1) {
  using Bits = std::conditional_t<sizeof(Float) == 8, std::uint64_t, std::uint32_t>;
  std::string bytes("\x93NUMPY", 6);
  bytes += static_cast<char>(version);
  bytes += '\0';
  for (size_t i = 0; i < (version == 1 ? 2u : 4u); ++i) {
    bytes += static_cast<char>(dictionary.size() >> (8 * i) & 0xff);
  }
  bytes += dictionary;
  for (const Float value : values) {
    const auto bits = std::bit_cast<Bits>(value);
    for (size_t i = 0; i < sizeof(Float); ++i) {
      bytes += static_cast<char>(bits >> (8 * (big_endian ? sizeof(Float) - 1 - i : i)) & 0xff);
    }
  }
  return bytes;
}

const std::string kDouble23 = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }  \n";

TEST(Npy, HandWrittenFilesOfEveryKindGiveTheSameNumbers) {
  const std::vector<double> values = {1, 2, 3, 4, 5, 6.5};
  const std::vector<float> floats(values.begin(), values.end());
  const auto expect = [&](const std::string& bytes) {
    const NpyArray array = ParseNpy(bytes, "a.npy");
    EXPECT_THAT(array.shape, ElementsAre(2u, 3u));
    EXPECT_EQ(array.values, values);
  };
  expect(File(kDouble23, values));
  expect(File(kDouble23, values, false, 2));
  expect(File(kDouble23, values, false, 3));
  expect(File("{'descr': '>f8', 'fortran_order': False, 'shape': (2, 3)}", values, true));
  expect(File("{'shape':(2,3),'fortran_order':False,\"descr\":'<f4'}\n", floats));
  const std::vector<double> columns = {1, 4, 2, 5, 3, 6.5};
  expect(File("{'descr': '<f8', 'fortran_order': True, 'shape': (2, 3), }", columns));
}

TEST(Npy, ScalarsAndEmptyArraysAreArrays) {
  const auto scalar = File<double>("{'descr': '<f8', 'fortran_order': False, 'shape': ()}", {7});
  EXPECT_THAT(ParseNpy(scalar, "a.npy").values, ElementsAre(7));
  const auto empty = File<double>("{'descr': '<f8', 'fortran_order': True, 'shape': (0, 3)}", {});
  EXPECT_THAT(ParseNpy(empty, "a.npy").values, ElementsAre());
}

TEST(Npy, EveryTruncatedPrefixIsRejected) {
  const std::string good = File<double>(kDouble23, {1, 2, 3, 4, 5, 6});
  for (size_t length = 0; length < good.size(); ++length) {
    EXPECT_THROW(ParseNpy(std::string_view(good).substr(0, length), "a.npy"), Error) << length;
  }
  EXPECT_THROW(ParseNpy(good + "x", "a.npy"), Error);
}

TEST(Npy, HostileHeadersAreRejectedInOneLine) {
  const auto error_of = [](const std::string& dictionary) -> std::string {
    try {
      ParseNpy(File<double>(dictionary, {1, 2, 3, 4, 5, 6}), "a.npy");
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  };
  const std::string order = "'fortran_order': False, ";
  EXPECT_THAT(error_of("{'descr': '|O', " + order + "'shape': (2, 3)}"), HasSubstr("float32"));
  EXPECT_THAT(error_of("{'descr': [('a', '<f8')], " + order + "'shape': (6,)}"),
              HasSubstr("a structure"));
  // 2^32 * 2^32 elements wrap to 0 in 64 bits; 2^61 doubles wrap to 0 bytes.
  EXPECT_THAT(error_of("{'descr': '<f8', " + order + "'shape': (4294967296, 4294967296)}"),
              HasSubstr("as many bytes"));
  EXPECT_THAT(error_of("{'descr': '<f8', " + order + "'shape': (2305843009213693952,)}"),
              HasSubstr("as many bytes"));
  EXPECT_THAT(error_of("{'descr': '<f8', " + order + "'shape': (99999999999999999999,)}"),
              HasSubstr("whole numbers"));
  EXPECT_THAT(error_of("{'descr': '<f8', " + order + "'shape': (-2, -3)}"),
              HasSubstr("whole numbers"));
  EXPECT_THAT(error_of("{'descr': '<f8', " + order + "'shape': (1,1,1,1,1,1,1,1,6)}"),
              HasSubstr("8 dimensions"));
  EXPECT_THAT(error_of("{'descr': '<f8', 'descr': '<f8', 'shape': (6,)}"), HasSubstr("once each"));
  EXPECT_THAT(error_of("{'descr': '<f8', 'shape': (6,)}"), HasSubstr("fewer"));
  EXPECT_THAT(error_of("{'descr': '<f8"), HasSubstr("closing quote"));
  EXPECT_THAT(error_of(kDouble23 + "print(1)"), HasSubstr("end of the header"));
}

TEST(Npy, NumbersThatAreNotFiniteAreRejected) {
  EXPECT_THROW(ParseNpy(File<double>(kDouble23, {1, 2, 3, 4, 5, NAN}), "a.npy"), Error);
  EXPECT_THROW(ParseNpy(File<double>(kDouble23, {INFINITY, 2, 3, 4, 5, 6}), "a.npy"), Error);
}

}  // namespace
}  // namespace dtr::io
