// `dtr selftest`: the short form holds, and what does not hold is told.
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "cli/selftest/table.h"
#include "dtr/base/error.h"
#include "tests/cli/run_dtr.h"

namespace dtr::selftest {
namespace {

using Json = nlohmann::json;

Case CaseOf(const std::string& name, std::function<Outcome(const Conditions&)> run,
            bool quick = true) {
  return {"stage", name, quick, std::move(run)};
}

Row RunOne(std::function<Outcome(const Conditions&)> run) {
  SilentProgress progress;
  return RunCases({CaseOf("case", std::move(run))}, {}, true, progress).at(0);
}

Row RowOf(const Measure& measure) {
  return RunOne([measure](const Conditions&) {
    Outcome outcome;
    outcome.Add(measure);
    return outcome;
  });
}

TEST(StabilityRow, HoldsWhereItsValueHoldsTheBound) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(RowOf(AtMost("x", 1, 1, "")).passed());
  EXPECT_FALSE(RowOf(AtMost("x", 1.001, 1, "")).passed());
  EXPECT_TRUE(RowOf(AtLeast("x", 1, 1, "")).passed());
  EXPECT_FALSE(RowOf(AtLeast("x", 0.999, 1, "")).passed());
  EXPECT_TRUE(RowOf(Exactly("x", 0, 0, "")).passed());
  EXPECT_FALSE(RowOf(Exactly("x", 1e-300, 0, "")).passed());
  EXPECT_FALSE(RowOf(AtMost("x", kNaN, 1, "")).passed());
  EXPECT_FALSE(RowOf(AtLeast("x", kNaN, 1, "")).passed());
  EXPECT_FALSE(RowOf(Exactly("x", kNaN, kNaN, "")).passed());
}

TEST(StabilityRow, NothingMeasuredWhatIsNotFiniteAndWhatIsThrownFailIt) {
  EXPECT_FALSE(RunOne([](const Conditions&) { return Outcome(); }).passed());
  const auto look = [](double value) {
    return RunOne([value](const Conditions&) {
      Outcome outcome;
      outcome.Add(Exactly("x", 0, 0, ""));
      outcome.Look(value);
      return outcome;
    });
  };
  EXPECT_TRUE(look(1e300).passed());
  EXPECT_FALSE(look(std::numeric_limits<double>::infinity()).passed());
  const Row thrown = RunOne([](const Conditions&) -> Outcome { throw Error("broken"); });
  EXPECT_FALSE(thrown.passed());
  EXPECT_NE(ToMarkdown({thrown}).find("broken"), std::string::npos);
}

TEST(StabilityRow, ARefusalMustHappenAndKeepsItsWords) {
  const Row refused = RunOne([](const Conditions&) {
    Outcome outcome;
    ExpectRefusal(outcome, "it", [] { throw Error("words"); });
    return outcome;
  });
  EXPECT_TRUE(refused.passed());
  EXPECT_EQ(refused.outcome.refusal, "words");
  EXPECT_FALSE(RunOne([](const Conditions&) {
                 Outcome outcome;
                 ExpectRefusal(outcome, "it", [] {});
                 return outcome;
               }).passed());
}

TEST(StabilityTable, TheShortFormLeavesOutTheLongCases) {
  SilentProgress progress;
  const auto run = [](const Conditions&) { return Outcome(); };
  const std::vector<Case> cases = {CaseOf("a", run), CaseOf("b", run, false)};
  EXPECT_EQ(RunCases(cases, {}, true, progress).size(), 1u);
  EXPECT_EQ(RunCases(cases, {}, false, progress).size(), 2u);
}

TEST(Selftest, TheShortFormHoldsAndItsJsonHasTheDocumentedNames) {
  const testing::Ran ran = testing::Dtr({"selftest", "--json", "-"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  const Json json = Json::parse(ran.out);
  EXPECT_TRUE(json["passed"]);
  EXPECT_GE(json["rows"].size(), 45u);
  for (const Json& row : json["rows"]) {
    EXPECT_TRUE(row["passed"]) << row.dump(1);
    EXPECT_EQ(row["not_finite"], 0) << row.dump(1);
    EXPECT_TRUE(row["quick"]);
    for (const Json& measure : row["measures"]) {
      for (const char* name : {"what", "value", "relation", "bound", "passed", "reason"}) {
        EXPECT_TRUE(measure.contains(name)) << name;
      }
    }
  }
}

TEST(Selftest, APageNeedsTheWholeTable) {
  testing::ExpectRefused(testing::Dtr({"selftest", "-o", "table.md"}), 2,
                         "expected --stability with it");
}

}  // namespace
}  // namespace dtr::selftest
