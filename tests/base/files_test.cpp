#include "dtr/base/files.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <thread>

#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/file_stream.h"
#include "dtr/base/hash.h"
#include "dtr/base/regular_file.h"
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

TEST(WriteFileAtomically, LinksAreFollowedAndStay) {
  const testing::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "below");
  WriteFileAtomically(folder / "target", "old");
  std::filesystem::create_symlink("../target", folder / "below/first");
  std::filesystem::create_symlink("below/first", folder / "second");
  std::filesystem::create_symlink("new", folder / "dangling");
  WriteFileAtomically(folder / "second", "new");
  WriteFileAtomically(folder / "dangling", "made");
  EXPECT_EQ(ReadFile(folder / "target", 100), "new");
  EXPECT_EQ(ReadFile(folder / "new", 100), "made");
  for (const char* link : {"below/first", "second", "dangling"}) {
    EXPECT_TRUE(std::filesystem::is_symlink(folder / link)) << link;
  }
  std::filesystem::create_symlink("there", folder / "here");
  std::filesystem::create_symlink("here", folder / "there");
  EXPECT_THROW(WriteFileAtomically(folder / "here", "x"), Error);
  EXPECT_EQ(ResolveLinks(folder / "below"), folder / "below");
  EXPECT_EQ(ResolveLinks(folder / "nothing"), folder / "nothing");
}

TEST(WriteFileAtomically, PipesAreWrittenAndStay) {
  const testing::TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_TRUE(IsWrittenInPlace(folder / "pipe"));
  EXPECT_TRUE(IsWrittenInPlace("/dev/null"));
  EXPECT_TRUE(IsWrittenInPlace("/dev/stdout"));
  EXPECT_FALSE(IsWrittenInPlace("/dev/shm/nothing")) << "memory that holds files";
  EXPECT_FALSE(IsWrittenInPlace(folder / "nothing"));
  EXPECT_FALSE(IsWrittenInPlace(folder.path()));
  std::string found;
  std::thread reader([&] {
    std::ifstream pipe(folder / "pipe");
    std::getline(pipe, found);
  });
  WriteFileAtomically(folder / "pipe", "through");
  reader.join();
  EXPECT_EQ(found, "through");
  EXPECT_TRUE(std::filesystem::is_fifo(folder / "pipe"));
}

TEST(PublishFile, NeedsAFileOrNothing) {
  const testing::TemporaryFolder folder;
  WriteFileAtomically(folder / "made", "new");
  EXPECT_THROW(PublishFile(folder / "made", "/dev/null"), Error);
  WriteFileAtomically(folder / "old", "old");
  std::filesystem::create_symlink("old", folder / "link");
  PublishFile(folder / "made", folder / "link");
  EXPECT_EQ(ReadFile(folder / "old", 100), "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
}

TEST(FileStream, AFileOrLinkOfItsNameGoesFirst) {
  const testing::TemporaryFolder folder;
  WriteFileAtomically(folder / "precious", "p");
  std::filesystem::create_symlink("precious", folder / "out");
  FileStream out(folder / "out");
  out.Write("content");
  out.Flush();
  EXPECT_EQ(ReadFile(folder / "out", 100), "content");
  EXPECT_EQ(ReadFile(folder / "precious", 100), "p");
}

TEST(ARegularFile, IsReadAndNothingElse) {
  const testing::TemporaryFolder folder;
  WriteFileAtomically(folder / "file", "x");
  std::filesystem::create_symlink("file", folder / "link");
  EXPECT_NO_THROW(RequireRegularFile(folder / "link"));
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  for (const std::filesystem::path& other :
       {folder / "pipe", folder.path(), std::filesystem::path("/dev/zero"), folder / "nothing"}) {
    EXPECT_THROW(RequireRegularFile(other), Error) << other;
    EXPECT_THROW(StreamOf(other), Error) << other;
    EXPECT_THROW(ReadFile(other, 100), Error) << other;
    EXPECT_THROW(Sha256OfFile(other), Error) << other;
    EXPECT_THROW(CopyFileAtomically(other, folder / "copy"), Error) << other;
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "copy"));
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
