// `dtr build PROJECT --poses` where cameras are named below images/ and photos below the project.
#include <gtest/gtest.h>

#include "dtr/io/set_io.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

TEST(ProjectPoses, CamerasNamedBelowImagesAreThoseOfTheProjectsPhotos) {
  const TemporaryFolder folder;
  MakeSmallCourtyard(folder / "project");
  for (const char* poses : {"sparse", "cameras.json"}) {
    const std::string set = (folder / (std::string(poses) + ".dtr")).string();
    DtrOk({"build", (folder / "project").string(), "--poses", (folder / "project" / poses).string(),
           "-o", set, "--preset", "fast"});
    const DtrSet built = io::ReadSet(set);
    const auto& views = built.frames.front().views;
    ASSERT_EQ(views.size(), static_cast<size_t>(kCourtyardViews)) << poses;
    EXPECT_EQ(views.front().name, "images/0000.jpg");
  }
}

}  // namespace
}  // namespace dtr::testing
