// `dtr selftest`: the short form holds, and what does not hold is told.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>

#include "cli/selftest/table.h"
#include "dtr/base/error.h"
#include "dtr/cpu/renderer.h"

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

TEST(StabilityTable, JsonHasTheDocumentedNames) {
  const Row row = RowOf(AtMost("x", std::numeric_limits<double>::quiet_NaN(), 1, "why"));
  const Json json = Json::parse(ToJson({row}));
  EXPECT_FALSE(json["passed"]);
  const Json& found = json["rows"].at(0);
  for (const char* name :
       {"stage", "case", "quick", "passed", "not_finite", "refusal", "error", "measures"}) {
    EXPECT_TRUE(found.contains(name)) << name;
  }
  EXPECT_TRUE(found["measures"].at(0)["value"].is_null());
  for (const char* name : {"what", "value", "relation", "bound", "passed", "reason"}) {
    EXPECT_TRUE(found["measures"].at(0).contains(name)) << name;
  }
}

/// The short form, case by case, with the renderer that every build has.
std::vector<Case> QuickCases() {
  const std::vector<NamedRenderer> renderers = {
      {"cpu", [] { return RenderFunction(&cpu::Render); }}};
  std::vector<Case> quick;
  for (std::vector<Case>& stage : std::vector{BundleCases(), StereoCases(), DepthCodingCases(),
                                              BlendingCases(), RenderingCases(renderers)}) {
    std::copy_if(stage.begin(), stage.end(), std::back_inserter(quick),
                 [](const Case& each) { return each.quick; });
  }
  return quick;
}

/// A case's name as GoogleTest takes it.
std::string NameOf(const ::testing::TestParamInfo<Case>& info) {
  std::string name;
  for (const char c : info.param.stage + "_" + info.param.name) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) name += c;
  }
  return name + std::to_string(info.index);
}

class QuickStability : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(, QuickStability, ::testing::ValuesIn(QuickCases()), NameOf);

TEST_P(QuickStability, Holds) {
  SilentProgress progress;
  const Row row = RunCases({GetParam()}, {.threads = 2}, true, progress).at(0);
  EXPECT_TRUE(row.passed()) << ToJson({row});
}

}  // namespace
}  // namespace dtr::selftest
