// The whole stability table: it holds, and knows nothing of the number of threads.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/cli/run_dtr.h"

namespace dtr::testing {
namespace {

TEST(StabilityTable, HoldsWithTheSameBytesForOneThreadAndTwo) {
  const Ran one = Dtr({"selftest", "--stability", "--threads", "1", "--json", "-"});
  EXPECT_EQ(one.code, 0) << one.err;
  for (const nlohmann::json& row : nlohmann::json::parse(one.out)["rows"]) {
    EXPECT_TRUE(row["passed"]) << row.dump(1);
  }
  const Ran two = Dtr({"selftest", "--stability", "--threads", "2", "--json", "-"});
  EXPECT_EQ(one.out, two.out);
}

TEST(StabilityTable, APageNeedsTheWholeTable) {
  ExpectRefused(Dtr({"selftest", "-o", "table.md"}), 2, "expected --stability with it");
}

}  // namespace
}  // namespace dtr::testing
