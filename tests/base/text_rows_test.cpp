#include "dtr/base/text_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dtr/base/error.h"
#include "tests/support/message_of.h"

namespace dtr {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::MessageOf;

std::vector<std::string> Cells(const std::string& line) { return CellsOf(line, SeparatorOf(line)); }

TEST(CellsOf, WhateverSeparatesThemEmptyOnesAreCells) {
  EXPECT_THAT(Cells("a, b ,,c, "), ElementsAre("a", "b", "", "c", ""));
  EXPECT_THAT(Cells("1,5;2,5;;x"), ElementsAre("1,5", "2,5", "", "x"));
  EXPECT_THAT(Cells("1,5\t2,5\t\tx y"), ElementsAre("1,5", "2,5", "", "x y"));
  EXPECT_THAT(Cells("1,\t2,\t3"), ElementsAre("1", "2", "3"));
  EXPECT_THAT(Cells("  a  b "), ElementsAre("a", "b"));
  EXPECT_THAT(Cells(""), ElementsAre());
}

TEST(CellsOf, QuotesHideSeparators) {
  EXPECT_THAT(Cells(R"("a;b",1,"say ""x""")"), ElementsAre("a;b", "1", "say \"x\""));
  EXPECT_THAT(Cells(R"("left cam/0.jpg"  1 2)"), ElementsAre("left cam/0.jpg", "1", "2"));
}

TEST(TextRows, EmptyLinesAndCommentsAreNoRows) {
  TextRows rows("# time x\n\n 1 2\n  # more\n3\t4\n5, 6", "f");
  std::vector<double> numbers;
  std::vector<int> lines;
  while (rows.Next()) {
    rows.ExpectCells(2, "a time and x");
    numbers.push_back(rows.Number(0, "a time"));
    numbers.push_back(rows.Number(1, "x"));
    lines.push_back(rows.line());
  }
  EXPECT_THAT(numbers, ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(lines, ElementsAre(3, 5, 6));
}

TEST(TextRows, WhatARowLacksIsNamedWithItsLine) {
  TextRows rows("1 2\n3\n", "f");
  rows.Next();
  rows.Next();
  EXPECT_THAT(MessageOf<Error>([&] { rows.ExpectCells(2, "a time and x"); }),
              HasSubstr("f:2: expected 2 cells in a row, a time and x, found 1"));
  EXPECT_THAT(MessageOf<Error>([&] { rows.Number(1, "x"); }),
              HasSubstr("f:2: x: expected a finite number, found an empty cell"));
}

TEST(TextTable, ColumnsGoByTheirNames) {
  TextTable table("#cameras 2\n# Name ;K1 (radial); x;\n\n\"a;b.jpg\"; 0.5 ;7;\nc.jpg;1;\n", "f",
                  "#cameras");
  ASSERT_TRUE(table.Find({"radial", "k1"}));
  const size_t k1 = *table.Find({"k1"}), x = table.Column({"x"});
  ASSERT_TRUE(table.Next());
  EXPECT_EQ(table.Cell(table.Column({"name"})), "a;b.jpg");
  EXPECT_EQ(table.Number(k1), 0.5);
  EXPECT_EQ(table.Number(x), 7);
  EXPECT_EQ(table.line(), 4);
  ASSERT_TRUE(table.Next());
  EXPECT_EQ(table.Cell(x), "");
  EXPECT_THAT(MessageOf<Error>([&] { table.Number(x); }),
              HasSubstr("f:5: x: expected a finite number, found an empty cell"));
  EXPECT_FALSE(table.Next());
}

TEST(TextTable, WhatItCannotMeanIsNamed) {
  EXPECT_THAT(MessageOf<Error>([] { TextTable("a,b,A\n", "f"); }),
              HasSubstr("f:1: the column a stands twice"));
  EXPECT_THAT(MessageOf<Error>([] { TextTable("a,b\n", "f").Column({"c"}); }),
              HasSubstr("f: expected a column c, found a, b"));
  EXPECT_THAT(MessageOf<Error>([] { TextTable("", "f").Column({"c"}); }),
              HasSubstr("expected a column c, found none"));
  const auto first_row = [](const char* text) {
    return MessageOf<Error>([&] {
      TextTable table(text, "f");
      table.Next();
      table.Number(0);
    });
  };
  EXPECT_THAT(first_row("a,b\n1,5,2,5\n"),
              HasSubstr("f:2: expected 2 columns as the first line has, found 4; numbers must have "
                        "a decimal point"));
  EXPECT_THAT(first_row("a;b\n1,5;2,5\n"),
              HasSubstr("f:2: a: expected a finite number, found '1,5'; write numbers with a "
                        "decimal point, not a comma"));
}

TEST(NumbersText, NumbersStandBetweenAnySeparators) {
  EXPECT_EQ(NumbersText("# K\n1.5, 0,3\n0;2;4\n0 0\t1\n", "f"), "\n1.5 0 3 \n0 2 4 \n0 0 1 \n");
  for (const char* text : {"1\n1,5;0;3\n", "1\n1,5\t0\t3\n", "1\n1,5 0 3\n"}) {
    EXPECT_THAT(MessageOf<Error>([&] { NumbersText(text, "f"); }),
                HasSubstr("where a number should stand; write numbers with a decimal point"))
        << text;
  }
}

}  // namespace
}  // namespace dtr
