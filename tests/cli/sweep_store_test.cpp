#include "cli/sweep_store.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "dtr/base/temporary_folder.h"

namespace dtr::cli {
namespace {

// JSON has no infinity, and a run that resumes must find what the first one measured.
TEST(SweepFile, GivesBackWhatEqualsThePhotosAndWhatHasNoFigure) {
  const TemporaryFolder folder;
  const eval::SweepStage stage;
  for (const std::optional<double> psnr_db :
       {std::optional(std::numeric_limits<double>::infinity()), std::optional(30.0),
        std::optional<double>()}) {
    const eval::SweepMeasurement measured{3, 2, 4, 1e-6, psnr_db, 0, {}};
    SweepFile(folder.path() / "work.json").Of(stage, "conditions")->Keep({}, measured);
    SweepFile again(folder.path() / "work.json");
    const auto found = again.Of(stage, "conditions")->Find({});
    ASSERT_TRUE(found.has_value());
    EXPECT_EQ(found->psnr_db, psnr_db);
  }
}

}  // namespace
}  // namespace dtr::cli
