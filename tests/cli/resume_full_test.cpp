// The long forms of resume_test.
#include "tests/cli/resuming.h"

namespace dtr::testing {
namespace {

using ResumingLong = FullDisk;

// Twenty moments, each in a run of its own.
TEST_F(ResumingLong, TwentyRandomKills) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    KillAndFinish("killed" + std::to_string(seed), 1, 100 + seed);
  }
}

// So little at a time that every stage is stopped in the middle.
TEST_F(ResumingLong, FullDiskAtEveryStage) { GrowUntilFinished(24, 10); }

}  // namespace
}  // namespace dtr::testing
