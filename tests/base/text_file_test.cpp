#include "dtr/base/text_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dtr/base/error.h"
#include "tests/support/message_of.h"

namespace dtr {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// "é" and a character beyond 16 bits, each unit in the order of its bytes.
std::string Utf16(const std::u16string& text, bool big_endian) {
  std::string bytes = big_endian ? "\xfe\xff" : "\xff\xfe";
  for (const char16_t unit : text) {
    const char low = static_cast<char>(unit & 0xff), high = static_cast<char>(unit >> 8);
    bytes += big_endian ? std::string{high, low} : std::string{low, high};
  }
  return bytes;
}

TEST(TextOf, EveryLineEndIsOne) {
  for (const char* bytes : {"a\nb\n", "a\r\nb\r\n", "a\rb\r", "a\nb", "a\r\nb", "a\rb"}) {
    EXPECT_EQ(TextOf(bytes, "f"), "a\nb\n");
  }
  EXPECT_EQ(TextOf("a\r\n\r\nb\n\r", "f"), "a\n\nb\n\n");
  EXPECT_EQ(TextOf("", "f"), "");
}

TEST(TextOf, ByteOrderMarksAreNoText) {
  EXPECT_EQ(TextOf("\xef\xbb\xbf"
                   "a\n",
                   "f"),
            "a\n");
  for (const bool big_endian : {false, true}) {
    EXPECT_EQ(TextOf(Utf16(u"h\u00e9 \u20ac\U0001f600\r\n1", big_endian), "f"),
              "h\xc3\xa9 \xe2\x82\xac\xf0\x9f\x98\x80\n1\n");
  }
}

TEST(TextOf, WhatIsNoTextIsAnError) {
  using testing::MessageOf;
  EXPECT_THAT(MessageOf<Error>([] { TextOf(std::string("a\0b", 3), "f"); }),
              AllOf(HasSubstr("f: is no text, byte 1 is 0"), HasSubstr("UTF-8")));
  // UTF-16 without its mark, cut in a unit, and cut between the two units of a character.
  EXPECT_THAT(MessageOf<Error>([] { TextOf(Utf16(u"ab", false).substr(2), "f"); }),
              HasSubstr("byte 1 is 0"));
  EXPECT_THAT(MessageOf<Error>([] { TextOf(Utf16(u"ab", false).substr(0, 5), "f"); }),
              HasSubstr("UTF-16 breaks off"));
  EXPECT_THAT(MessageOf<Error>([] { TextOf(Utf16(u"\U0001f600", true).substr(0, 4), "f"); }),
              HasSubstr("UTF-16 breaks off"));
}

TEST(TextOfHead, ABeginningMayBreakOffAndBeNoText) {
  EXPECT_EQ(TextOfHead(Utf16(u"ab\r\nc", false).substr(0, 7)), "ab");
  EXPECT_EQ(TextOfHead(std::string("\x93NUMPY\x01\0", 8)), std::string("\x93NUMPY\x01\0", 8));
}

TEST(FiniteNumber, IsAWholeWordThatIsANumber) {
  EXPECT_EQ(FiniteNumber("-1.5e3"), -1500);
  EXPECT_EQ(FiniteNumber("+2."), 2);
  for (const char* word : {"", "+", "+-1", "1,5", "1 ", " 1", "1x", "nan", "inf", "1e999", "--1"}) {
    EXPECT_EQ(FiniteNumber(word), std::nullopt) << word;
  }
}

TEST(DecimalCommaHint, IsForNumbersWithACommaAlone) {
  EXPECT_THAT(DecimalCommaHint("1,5"), HasSubstr("decimal point"));
  EXPECT_THAT(DecimalCommaHint("-0,25e3"), HasSubstr("decimal point"));
  for (const char* word : {"1.5", "a,b", "1,2,3", ""}) EXPECT_EQ(DecimalCommaHint(word), "");
}

}  // namespace
}  // namespace dtr
