// docs/FORMAT.md shows a worked set.json; this keeps it true.
#include <gtest/gtest.h>

#include <fstream>
#include <iostream>
#include <regex>

#include "dtr/base/files.h"
#include "dtr/io/set_io.h"
#include "dtr/io/set_json.h"
#include "tests/io/small_set.h"
#include "tests/support/test_data.h"

namespace dtr::io {
namespace {

constexpr char kDocument[] = "docs/FORMAT.md";  // tests run in the root of the sources

// Hashes and sizes depend on the version of zlib; everything else must match.
std::string WithoutHashes(const std::string& text) {
  const std::string masked = std::regex_replace(text, std::regex("[0-9a-f]{64}"), "H");
  return std::regex_replace(masked, std::regex("\"bytes\": [0-9]+"), "\"bytes\": N");
}

TEST(FormatDocument, WorkedExampleIsWhatTheWriterWrites) {
  const testing::TemporaryFolder folder;
  testing_support::WriteSmallSet(folder / "small.dtr");
  const std::string written = ReadFile(folder / "small.dtr/set.json", 1 << 20);
  const std::string document = ReadFile(kDocument, 1 << 20);
  const size_t begin = document.find("```json\n{\n  \"format\": \"dtr-set\"");
  ASSERT_NE(begin, std::string::npos) << kDocument << " has no worked set.json";
  const size_t start = begin + 8, end = document.find("```", start);
  EXPECT_EQ(WithoutHashes(document.substr(start, end - start)), WithoutHashes(written));
  EXPECT_NO_THROW(SetFromJson(document.substr(start, end - start), kDocument));
}

}  // namespace
}  // namespace dtr::io
