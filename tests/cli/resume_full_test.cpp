// The long forms of resume_test and resume_video_test.
#include "tests/cli/resuming_video.h"

namespace dtr::testing {
namespace {

using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::Key;
using ResumingLong = FullDisk;

// Twenty moments, each in a run of its own.
TEST_F(ResumingLong, TwentyRandomKills) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    KillAndFinish("killed" + std::to_string(seed), 1, 100 + seed);
  }
}

// So little at a time that every stage is stopped in the middle. Depth maps take the place of what
// the passes before them needed: there the disk is filled on the way.
TEST_F(ResumingLong, FullDiskAtEveryStage) {
  GrowUntilFinished(24, 10);
  FillAt("depth");
  for (const char* stage : {"reading photos", "matching", "consistency pass 1", "depth"}) {
    EXPECT_THAT(stopped_in_, Contains(Key(stage)));
  }
  EXPECT_THAT(stopped_in_["reading photos"], Contains("images"));
  EXPECT_THAT(stopped_in_["matching"], Contains("work"));
  EXPECT_THAT(stopped_in_["consistency pass 1"], Contains("work"));
  EXPECT_THAT(stopped_in_["depth"], Contains(AnyOf("depth", "sigma")));
  EXPECT_THAT(stopped_in_["cameras against their observations"], Contains("sparse.bin"));
  EXPECT_THAT(stopped_in_["page"], Contains("report"));
}

// The same from the video on. Its set is larger, and every run refines: longer steps.
TEST_F(VideoBySfm, FullDiskAtEveryStage) {
  GrowUntilFinished(96, 8);
  for (const char* stage : {"writing frames", "writing photos", "mapping", "undistorting",
                            "matching", "bundle adjustment", "consistency pass 1", "page"}) {
    EXPECT_THAT(stopped_in_, Contains(Key(stage)));
  }
}

}  // namespace
}  // namespace dtr::testing
