#include "dtr/base/files.h"

#include <gtest/gtest.h>

#include "dtr/base/error.h"
#include "dtr/base/hash.h"
#include "tests/support/test_data.h"

namespace dtr {
namespace {

TEST(WriteFileAtomically, ReplacesTheContentAndLeavesNothingBeside) {
  const testing::TemporaryFolder folder;
  WriteFileAtomically(folder / "a.txt", "first");
  WriteFileAtomically(folder / "a.txt", "second");
  EXPECT_EQ(ReadFile(folder / "a.txt", 100), "second");
  int files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    ++files;
  }
  EXPECT_EQ(files, 1);
}

TEST(WriteFileAtomically, FailureIsAnErrorAndLeavesNoTemporaryFile) {
  const testing::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "taken");
  EXPECT_THROW(WriteFileAtomically(folder / "taken", "x"), Error);
  EXPECT_THROW(WriteFileAtomically(folder / "no/such/folder.txt", "x"), Error);
  int files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    ++files;
  }
  EXPECT_EQ(files, 1);
}

TEST(ReadFile, RejectsMoreThanTheLimit) {
  const testing::TemporaryFolder folder;
  WriteFileAtomically(folder / "a.txt", "12345");
  EXPECT_EQ(ReadFile(folder / "a.txt", 5), "12345");
  EXPECT_THROW(ReadFile(folder / "a.txt", 4), Error);
  EXPECT_THROW(ReadFile(folder / "absent.txt", 5), Error);
}

TEST(Sha256, MatchesThePublishedVectorForAbc) {  // FIPS 180-2, appendix B.1
  const std::string abc = "abc";
  EXPECT_EQ(Sha256(std::as_bytes(std::span(abc))),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  const testing::TemporaryFolder folder;
  WriteFileAtomically(folder / "abc", abc);
  EXPECT_EQ(Sha256OfFile(folder / "abc"), Sha256(std::as_bytes(std::span(abc))));
}

}  // namespace
}  // namespace dtr
