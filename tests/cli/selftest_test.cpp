// `dtr selftest`: the short form holds, and what does not hold is told.
#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "dtr/base/error.h"
#include "dtr/cpu/renderer.h"
#include "dtr/simd/renderer.h"
#include "tests/cli/quick_stability.h"

namespace dtr::selftest {
namespace {

using Json = nlohmann::json;

Case CaseOf(const std::string& name, std::function<Outcome()> run, bool quick = true) {
  return {"stage", name, quick, std::move(run)};
}

Row RunOne(std::function<Outcome()> run) {
  SilentProgress progress;
  return RunCases({CaseOf("case", std::move(run))}, true, progress).at(0);
}

Row RowOf(const Measure& measure) {
  return RunOne([measure]() {
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
  EXPECT_FALSE(RunOne([]() { return Outcome(); }).passed());
  const auto look = [](double value) {
    return RunOne([value]() {
      Outcome outcome;
      outcome.Add(Exactly("x", 0, 0, ""));
      outcome.Look(value);
      return outcome;
    });
  };
  EXPECT_TRUE(look(1e300).passed());
  EXPECT_FALSE(look(std::numeric_limits<double>::infinity()).passed());
  const Row thrown = RunOne([]() -> Outcome { throw Error("broken"); });
  EXPECT_FALSE(thrown.passed());
  EXPECT_NE(ToMarkdown({thrown}).find("broken"), std::string::npos);
}

TEST(StabilityRow, ARejectionMustHappenAndKeepsItsWords) {
  const Row refused = RunOne([]() {
    Outcome outcome;
    ExpectRejection(outcome, "it", [] { throw Error("words"); });
    return outcome;
  });
  EXPECT_TRUE(refused.passed());
  EXPECT_EQ(refused.outcome.rejection, "words");
  EXPECT_FALSE(RunOne([]() {
                 Outcome outcome;
                 ExpectRejection(outcome, "it", [] {});
                 return outcome;
               }).passed());
}

TEST(StabilityTable, TheShortFormLeavesOutTheLongCases) {
  SilentProgress progress;
  const auto run = []() { return Outcome(); };
  const std::vector<Case> cases = {CaseOf("a", run), CaseOf("b", run, false)};
  EXPECT_EQ(RunCases(cases, true, progress).size(), 1u);
  EXPECT_EQ(RunCases(cases, false, progress).size(), 2u);
}

TEST(StabilityTable, JsonHasTheDocumentedNames) {
  const Row row = RowOf(AtMost("x", std::numeric_limits<double>::quiet_NaN(), 1, "why"));
  const Json json = Json::parse(ToJson({row}));
  EXPECT_FALSE(json["passed"]);
  const Json& found = json["rows"].at(0);
  for (const char* name : {"stage", "case", "quick", "passed", "not_finite", "rejection", "error",
                           "skipped", "measures"}) {
    EXPECT_TRUE(found.contains(name)) << name;
  }
  EXPECT_TRUE(found["measures"].at(0)["value"].is_null());
  for (const char* name : {"what", "value", "relation", "bound", "passed", "reason"}) {
    EXPECT_TRUE(found["measures"].at(0).contains(name)) << name;
  }
}

std::vector<NamedRenderer> WithoutOpenGl() {
  const auto simd = [] {
    const auto renderer = std::make_shared<simd::Renderer>();
    return RenderFunction([renderer](const auto&... of) { return renderer->Render(of...); });
  };
  return {{"gl", {}, "not asked for"},
          {"simd", simd, {}, {RenderMethod::kDeferred}},
          {"cpu", [] { return RenderFunction(&cpu::Render); }}};
}

std::vector<Case> QuickCases() {
  std::vector<Case> quick = QuickOnes(AllCases(WithoutOpenGl()));
  std::erase_if(quick, [](const Case& each) { return !each.skipped.empty(); });
  return quick;
}

TEST(StabilityTable, WhatCannotBeRunIsListedNeverPassedNeverFailed) {
  Case lost = CaseOf("b", []() -> Outcome { throw Error("run all the same"); });
  lost.skipped = "no such machine";
  const Case fine = CaseOf("a", []() {
    Outcome outcome;
    outcome.Add(Exactly("x", 0, 0, ""));
    return outcome;
  });
  SilentProgress progress;
  const std::vector<Row> rows = RunCases({fine, lost}, true, progress);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_FALSE(rows[1].passed());
  EXPECT_FALSE(rows[1].failed());
  EXPECT_EQ(Summary(rows), "1 of 2 cases hold; 1 SKIPPED: stage: no such machine");
  EXPECT_NE(ToMarkdown(rows).find("1 of 2 cases hold; 1 SKIPPED: stage: no such machine.\n"),
            std::string::npos);
  EXPECT_NE(ToMarkdown(rows).find("| b * | SKIPPED | no such machine |"), std::string::npos);
  const Json json = Json::parse(ToJson(rows));
  EXPECT_TRUE(json["passed"]);
  EXPECT_TRUE(json["rows"][1]["passed"].is_null());
  EXPECT_EQ(json["rows"][1]["skipped"], "no such machine");
}

TEST(StabilityTable, APageShowsTheValueNearestItsBoundOrTheOneThatFails) {
  const auto row_of = [](std::vector<Measure> measures) {
    return ToMarkdown({RunOne([measures]() {
      Outcome outcome;
      for (const Measure& each : measures) outcome.Add(each);
      return outcome;
    })});
  };
  const Measure wide = AtMost("wide", 1, 10, ""), close = AtLeast("close", 2.1, 2, ""),
                exact = Exactly("exact", 3, 3, "");
  EXPECT_NE(row_of({exact, wide, close}).find("| case * | 3 | close: 2.1 (>= 2) |"),
            std::string::npos);
  EXPECT_NE(row_of({exact}).find("| case * | 1 | exact: 3 (= 3) |"), std::string::npos);
  EXPECT_NE(row_of({close, Exactly("wrong", 4, 3, "")}).find("| 2 FAILS | wrong: 4 (= 3) |"),
            std::string::npos);
}

TEST(StabilityTable, ThePageHasEveryCaseAndNoOther) {
  std::vector<std::string> expected, found;
  std::string stage;
  for (const Case& each : AllCases(WithoutOpenGl())) {
    if (each.stage != stage) expected.push_back("## " + each.stage);
    stage = each.stage;
    expected.push_back(each.name + (each.quick ? " *" : ""));
  }
  std::ifstream page("docs/measurements/stability.md");  // tests run in the root of the sources
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("## ")) found.push_back(line);
    if (!line.starts_with("| ") || line.starts_with("| case |")) continue;
    found.push_back(line.substr(2, line.find(" | ") - 2));
  }
  EXPECT_EQ(found, expected) << "scripts/measure stability writes it again";
}

class QuickStability : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(, QuickStability, ::testing::ValuesIn(QuickCases()), TestNameOf);

TEST_P(QuickStability, Holds) { ExpectHolds(GetParam()); }

}  // namespace
}  // namespace dtr::selftest
