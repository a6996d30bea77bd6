// What --trace records, and that a build has the parallel structure that scripts/scaling finds in
// it.
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "dtr/base/process.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

class Traced : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    MakeSmallCourtyard(*folder_ / "courtyard");
  }
  static void TearDownTestSuite() { folder_.reset(); }
  /// Of a build that asks for 16 threads.
  static fs::path Trace(const std::string& name) {
    const fs::path trace = *folder_ / (name + ".json");
    DtrOk({"build", (*folder_ / "courtyard/images").string(), "--poses",
           (*folder_ / "courtyard/cameras.json").string(), "-o", (*folder_ / name).string(),
           "--preset", "fast", "--threads", "16", "--trace", trace.string()});
    return trace;
  }
  static nlohmann::json EventsOf(const fs::path& trace) {
    return nlohmann::json::parse(ReadFile(trace, 1 << 28)).at("traceEvents");
  }
  static std::unique_ptr<TemporaryFolder> folder_;
};

std::unique_ptr<TemporaryFolder> Traced::folder_;

/// Items by the names of their loops.
std::map<std::string, int> ItemsOf(const nlohmann::json& events) {
  std::map<std::string, int> items;
  for (const auto& event : events) {
    if (event.at("cat") == "item")
      items[event.at("name")] += event.at("args").at("count").get<int>();
  }
  return items;
}

TEST_F(Traced, ABuildRunsTheSameLoopsAndItemsEveryTime) {
  const nlohmann::json once = EventsOf(Trace("once"));
  const std::map<std::string, int> items = ItemsOf(once);
  EXPECT_GT(items.size(), 20u);
  EXPECT_EQ(ItemsOf(EventsOf(Trace("again"))), items);
  int processes = 0;
  for (const auto& event : once) {
    EXPECT_EQ(event.at("ph"), "X");
    EXPECT_GE(event.at("dur").get<double>(), 0);
    EXPECT_GE(event.at("tdur").get<double>(), 0);
    processes += event.at("cat") == "process";
  }
  EXPECT_EQ(processes, 1);
}

// The figures of scripts/scaling are of processor time, so other work hardly changes them.
TEST_F(Traced, ABuildWouldUseSixteenCores) {
  std::map<std::string, double> found;  // "serial %", and how many times as fast so many cores are
  ProcessOptions options;
  options.on_line = [&](const std::string& line) {
    double cores = 0, seconds = 0, times = 0;
    if (std::sscanf(line.c_str(), "%lf cores: %lf s, %lf times", &cores, &seconds, &times) == 3) {
      found[std::to_string(static_cast<int>(cores))] = times;
    }
    double work = 0, serial = 0, share = 0;
    if (std::sscanf(line.c_str(), "work %lf s, of it outside all loops %lf s (%lf %%)", &work,
                    &serial, &share) == 3) {
      found["serial %"] = share;
    }
  };
  ASSERT_TRUE(
      RunProcess({DTR_PYTHON, DTR_SCRIPTS "/scaling", Trace("wide").string()}, options).Ok());
  ASSERT_EQ(found.size(), 8u);
  EXPECT_NEAR(found["1"], 1, 0.01);
  EXPECT_GT(found["2"], 1.7);
  EXPECT_GT(found["16"], 5) << "of photos of 192x128";
  EXPECT_LT(found["serial %"], 12);
}

TEST_F(Traced, WhatFailedIsTracedAsWell) {
  const fs::path trace = *folder_ / "failed.json";
  EXPECT_EQ(Dtr({"info", (*folder_ / "nothing.dtr").string(), "--trace", trace.string()}).code, 1);
  EXPECT_EQ(EventsOf(trace).at(0).at("cat"), "process");
}

TEST_F(Traced, AFileThatCannotBeIsNamedBeforeTheWork) {
  ExpectRejected(Dtr({"info", (*folder_ / "no.dtr").string(), "--trace",
                      (*folder_ / "no/trace.json").string()}),
                 kWrongUsage, "expected an existing folder to write into, found nothing");
}

}  // namespace
}  // namespace dtr::testing
