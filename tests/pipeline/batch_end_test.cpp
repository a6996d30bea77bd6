// A batch whose parts all end well, and yet there is no set.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "dtr/base/error.h"
#include "dtr/base/quiet_progress.h"
#include "pipeline/batch/batch.h"
#include "tests/support/message_of.h"
#include "tests/support/noted_lines.h"
#include "tests/support/test_data.h"

namespace dtr::pipeline {
namespace {

TEST(BatchEnd, WithoutASetItIsAnError) {
  const testing::TemporaryFolder folder;
  std::filesystem::create_directories(folder / "photos");
  BatchOptions options;
  options.build.photos = folder / "photos";
  options.build.output = folder / "set.dtr";
  options.build.depth.engine = "none";
  options.program = "/bin/true";
  options.directory = folder.path();
  options.array_size = 2;
  options.local = 2;
  testing::NotedLines progress;
  EXPECT_THAT(testing::MessageOf<Error>([&] {
                RunBatch(
                    options, [](const std::string&) {}, progress);
              }),
              ::testing::HasSubstr("expected the set, as all of its parts ended well, found none"));
}

}  // namespace
}  // namespace dtr::pipeline
