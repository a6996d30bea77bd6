// The whole stability table holds and knows nothing of the number of threads.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "dtr/base/temporary_folder.h"
#include "tests/cli/quick_stability.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/environment.h"

namespace dtr::testing {
namespace {

TEST(StabilityTable, HoldsWithTheSameBytesForOneThreadAndTwo) {
  const TemporaryFolder folder;
  const std::string page = folder / "page.md";
  const Ran one = Dtr({"selftest", "--stability", "--threads", "1", "--json", "-", "-o", page});
  EXPECT_EQ(one.code, 0) << one.err;
  const nlohmann::json table = nlohmann::json::parse(one.out);
  for (const nlohmann::json& row : table["rows"]) {
    if (row["skipped"] == "") {
      EXPECT_TRUE(row["passed"]) << row.dump(1);
    }
  }
  EXPECT_TRUE(fs::exists(page));
  const Ran two = Dtr({"selftest", "--stability", "--threads", "2", "--json", "-"});
  EXPECT_EQ(one.out, two.out);
}

TEST(StabilityTable, WithoutOpenGlItsCasesAreNamedAsSkipped) {
  const Environment no_driver("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent");
  const Ran ran = Dtr({"selftest", "--json", "-"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  int skipped = 0;
  const nlohmann::json table = nlohmann::json::parse(ran.out);
  for (const nlohmann::json& row : table["rows"]) {
    if (row["stage"] != "Rendering, gl") continue;
    EXPECT_TRUE(row["passed"].is_null());
    EXPECT_NE(row["skipped"], "");
    ++skipped;
  }
  EXPECT_EQ(skipped, 11);  // the short form's
}

TEST(StabilityTable, APageNeedsTheWholeTable) {
  ExpectRejected(Dtr({"selftest", "-o", "table.md"}), 2, "expected --stability with it");
}

}  // namespace
}  // namespace dtr::testing
