// `dtr build` goes on after it was killed or the disk was full; resume_full_test has the long
// forms.
#include "tests/cli/resuming.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

TEST_F(Resuming, KilledAtRandomMomentsItIsFinishedToTheSameBytes) { KillAndFinish("killed", 3, 1); }

int FilesOlderThan(const fs::path& folder, fs::file_time_type moment) {
  int files = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    files += entry.last_write_time() < moment ? 1 : 0;
  }
  return files;
}

TEST_F(Resuming, AForcedStageIsDoneAgainToTheSameBytes) {
  for (const std::string stage : {"calibration", "undistortion", "depth"}) {
    const fs::path set = Set(stage);
    const fs::path partial = set.string() + ".partial";
    const Ran cut = Dtr(Arguments(set), {SIGKILL, [&] { return FilesIn(partial / "depth") >= 1; }});
    ASSERT_EQ(cut.signal, SIGKILL) << cut.err;
    const auto cut_at = fs::file_time_type::clock::now();
    std::vector<std::string> again = Arguments(set);
    again.insert(again.end(), {"--force-stage", stage});
    DtrOk(again);
    ExpectFinished(set);
    EXPECT_EQ(FilesOlderThan(set / "depth", cut_at), 0) << stage;
    const int kept_images = FilesOlderThan(set / "images", cut_at);
    EXPECT_EQ(kept_images > 0, stage == "depth") << stage << ": " << kept_images;
  }
  std::vector<std::string> unknown = Arguments(Set("unknown"));
  unknown.insert(unknown.end(), {"--force-stage", "magic"});
  ExpectRejected(Dtr(unknown), 2,
                 "--force-stage: magic not in {capture,calibration,undistortion,depth}");
}

TEST_F(FullDisk, IsSaidInOneLineAndTheSameCommandContinuesWithRoom) { GrowUntilFinished(160, 2); }

}  // namespace
}  // namespace dtr::testing
