// `dtr build` of a video, without known cameras, goes on after it was stopped anywhere.
#include "tests/cli/resuming_video.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

TEST_F(VideoBySfm, KilledAnywhereItIsFinishedToTheSameBytes) { KillAndFinish("killed", 3, 7); }

// The model that structure from motion left is frozen: what comes after it is killed, for certain.
TEST_F(VideoBySfm, KilledAfterItsModelWasFrozenItIsFinishedWithoutColmap) {
  // Bundle adjustment is kept, too; a record of it that is damaged costs time alone.
  for (const bool damaged : {false, true}) {
    const fs::path set = Set(damaged ? "damaged" : "frozen");
    const fs::path partial = set.string() + ".partial";
    const Ran cut =
        Dtr(Arguments(set), {SIGKILL, [&] { return FilesIn(partial / "images") >= 1; }});
    ASSERT_EQ(cut.signal, SIGKILL) << cut.err;
    const fs::path record = partial / "work/calibration/refined/refined.json";
    ASSERT_TRUE(fs::exists(record));
    if (damaged) fs::resize_file(record, fs::file_size(record) / 2);
    colmap_.ForgetCalls();
    const Ran again = DtrOk(Arguments(set));
    EXPECT_EQ(again.err.find("bundle adjustment") != std::string::npos, damaged) << again.err;
    ExpectFinished(set);
    EXPECT_THAT(colmap_.Calls(), ::testing::IsEmpty());
  }
}

TEST_F(VideoBySfm, AForcedCaptureChoosesTheFramesAgainToTheSameBytes) {
  for (const bool forced : {false, true}) {
    const fs::path set = Set(forced ? "forced" : "plain");
    const fs::path partial = set.string() + ".partial";
    const Ran cut = Dtr(Arguments(set), {SIGKILL, [&] { return FilesIn(partial / "depth") >= 1; }});
    ASSERT_EQ(cut.signal, SIGKILL) << cut.err;
    const fs::path frames = partial / "work/capture/capture.json";
    const fs::file_time_type chosen_at = fs::last_write_time(frames);
    std::vector<std::string> again = Arguments(set);
    if (forced) again.insert(again.end(), {"--force-stage", "capture"});
    colmap_.ForgetCalls();
    // Its frames are gone once it is finished: looked at on the way.
    fs::file_time_type used;
    const Ran ran = Dtr(again, {SIGKILL, [&] {
                                  std::error_code gone;
                                  const auto at = fs::last_write_time(frames, gone);
                                  if (!gone) used = at;
                                  return false;
                                }});
    ASSERT_EQ(ran.code, 0) << ran.err;
    ExpectFinished(set);
    EXPECT_EQ(used > chosen_at, forced);
    EXPECT_EQ(colmap_.Calls().empty(), !forced);  // all that comes after it is done again too
  }
}

}  // namespace
}  // namespace dtr::testing
