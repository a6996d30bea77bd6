// `dtr export --format web --max-mb` where coarser coding is not enough: `dtr prune` leaves out.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/cli/web_page_bytes.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

class ExportWebPruned : public ::testing::Test {
 protected:
  void SetUp() override {
    MakeSmallCourtyard(folder_ / "courtyard");
    ImportSmallCourtyard(folder_ / "courtyard", folder_ / "set.dtr");
  }
  Ran Page(const std::string& name, const std::vector<std::string>& more) const {
    std::vector<std::string> arguments = {"export",   (folder_ / "set.dtr").string(),
                                          "--format", "web",
                                          "-o",       (folder_ / name).string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Dtr(arguments);
  }

  TemporaryFolder folder_;
};

TEST_F(ExportWebPruned, LeavesOutWhatImagesDoNotNeed) {
  ASSERT_EQ(Page("coarse.html", {"--jpeg-quality", "60", "--depth-error", "0.25"}).code, 0);
  const double limit = 0.98 * static_cast<double>(fs::file_size(folder_ / "coarse.html")) / 1e6;
  const Ran ran = Page("small.html", {"--max-mb", std::to_string(limit), "--json", "-"});
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_LE(static_cast<double>(fs::file_size(folder_ / "small.html")), 1e6 * limit);
  EXPECT_GT(nlohmann::json::parse(ran.out)["pruned_db"], 0);
}

// As all does that can: more coarsely coded it is larger.
TEST_F(ExportWebPruned, TheLeastThatIsNamedIsThatOfAPrunedSet) {
  ASSERT_EQ(Page("coarsest.html", {"--jpeg-quality", "15", "--depth-error", "0.5"}).code, 0);
  const Ran ran = Page("page.html", {"--max-mb", "0.01"});
  ExpectRejected(ran, kFailed, "the smallest page of this set takes");
  EXPECT_FALSE(fs::exists(folder_ / "page.html"));
  EXPECT_LT(1e6 * std::stod(Between(ran.err, "of this set takes ", " MB")),
            static_cast<double>(fs::file_size(folder_ / "coarsest.html")));
}

}  // namespace
}  // namespace dtr::testing
