// `dtr bench` without a table: what it writes, that its commands bring the same errors back, and
// that it goes on where it was.
#include <nlohmann/json.hpp>
#include <sstream>

#include "dtr/base/files.h"
#include "dtr/io/depth_io.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Json = nlohmann::json;

/// A set with true depth and sparse points, held-out photos among its views; made once.
class BenchSweep : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = new TemporaryFolder;
    MakeSmallCourtyard(*shared_ / "courtyard");
    ImportSmallCourtyard(*shared_ / "courtyard", *shared_ / "true.dtr");
    DtrOk({"build", (*shared_ / "courtyard/images").string(), "-o",
           (*shared_ / "cameras.dtr").string(), "--poses", (*shared_ / "courtyard/sparse").string(),
           "--engine", "none", "--holdout", "every:4"});
  }
  static void TearDownTestSuite() { delete shared_; }
  static std::string Shared(const std::string& name) { return (*shared_ / name).string(); }

  // A sweep of few points by the reference renderer: every machine has it.
  std::vector<std::string> Sweep(const std::string& points) const {
    return {"bench",
            Shared("true.dtr"),
            "--renderer",
            "cpu",
            "--views",
            "2,1",
            "--resolution",
            "4,8",
            "--size",
            "48x0",
            "--repeats",
            "2",
            "--cameras",
            "1",
            "--max-points",
            points,
            "--budget-ms",
            "100000",
            "-o",
            (folder_ / "out").string(),
            "--max-loss-db",
            "1"};
  }

  static TemporaryFolder* shared_;
  TemporaryFolder folder_;
};
TemporaryFolder* BenchSweep::shared_ = nullptr;

std::vector<std::string> WordsOf(const std::string& command) {
  std::istringstream stream(command);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  EXPECT_EQ(words.front(), "dtr");
  words.erase(words.begin());
  return words;
}

TEST_F(BenchSweep, EveryPointsCommandBringsItsErrorBack) {
  const Ran ran = DtrOk(Sweep("4"));
  EXPECT_THAT(ran.out, HasSubstr("the cheapest within 1 dB of the best"));
  EXPECT_THAT(ran.out, HasSubstr("the best within 100000"));
  const Json json = Json::parse(Text(folder_ / "out/bench.json"));
  const Json& stage = json["stages"][0];
  EXPECT_EQ(stage["stage"], "render");
  ASSERT_EQ(stage["points"].size(), 4u);
  EXPECT_EQ(stage["points"][0]["setting"], "default");
  EXPECT_EQ(stage["points"][0]["options"]["views"], "2");
  EXPECT_FALSE(stage["front"].empty());
  EXPECT_GT(stage["machine_ms"]["median"], 0);
  for (const Json& point : stage["points"]) {
    EXPECT_LE(point["cost_least"], point["cost"]);
    EXPECT_GE(point["cost_most"], point["cost"]);
    std::vector<std::string> words = WordsOf(point["command"]);
    words.insert(words.end(), {"--json", "-"});
    const Json again = Json::parse(DtrOk(words).out)["stages"][0]["points"][0];
    EXPECT_EQ(again["setting"], point["setting"]);
    EXPECT_EQ(again["error"], point["error"]) << point["command"];
    EXPECT_EQ(again["command"], point["command"]);
  }
  const std::string csv = Text(folder_ / "out/bench.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 5);
  const std::string page = Text(folder_ / "out/bench.html");
  EXPECT_THAT(page, HasSubstr("<svg"));
  EXPECT_THAT(page, HasSubstr("--point method=deferred,"));
  EXPECT_THAT(page, HasSubstr("views=2,")) << "what the default is today may change";
}

TEST_F(BenchSweep, GoesOnFromWhatWasMeasured) {
  DtrOk(Sweep("2"));
  const Json two = Json::parse(Text(folder_ / "out/work.json"));
  ASSERT_EQ(two["measurements"].size(), 2u);
  DtrOk(Sweep("3"));
  const std::string work = Text(folder_ / "out/work.json"),
                    result = Text(folder_ / "out/bench.json");
  const Json three = Json::parse(work);
  ASSERT_EQ(three["measurements"].size(), 3u);
  for (const Json& one : two["measurements"]) {
    EXPECT_THAT(three["measurements"], ::testing::Contains(one));  // times and all
  }
  DtrOk(Sweep("3"));
  EXPECT_EQ(Text(folder_ / "out/work.json"), work);
  EXPECT_EQ(Text(folder_ / "out/bench.json"), result);
  // Other conditions are other measurements.
  std::vector<std::string> other = Sweep("3");
  other.insert(other.end(), {"--exponent", "3"});
  DtrOk(other);
  EXPECT_EQ(Json::parse(Text(folder_ / "out/work.json"))["measurements"].size(), 6u);

  for (size_t length = 0; length <= work.rfind('}'); length += 900) {
    WriteFileAtomically(folder_ / "out/work.json", work.substr(0, length));
    ASSERT_EQ(Dtr(Sweep("3")).code, kFailed) << length;
  }
  WriteFileAtomically(folder_ / "out/work.json", R"({"format": 2, "measurements": []})");
  ExpectRejected(Dtr(Sweep("3")), kFailed, "work.json: format: expected 1, found 2");
}

TEST_F(BenchSweep, DepthByEngineAndSize) {
  std::vector<std::string> words{"bench",      Shared("cameras.dtr"),
                                 "--stage",    "stereo",
                                 "--max-size", "96,64",
                                 "--truth",    Shared("courtyard"),
                                 "--point",    "engine=sgbm",
                                 "--renderer", "cpu",
                                 "--json",     "-"};
  const Json point = Json::parse(DtrOk(words).out)["stages"][0]["points"][0];
  EXPECT_GT(point["cost"], 0);
  EXPECT_GT(point["psnr_db"], 8);
  const double right = point["figures"]["share_within_1pct"];
  EXPECT_DOUBLE_EQ(point["error"], 1 - right);
  EXPECT_GT(right, 0.02);
  words[9] = "engine=sgbm,max-size=64";
  const Json smaller = Json::parse(DtrOk(words).out)["stages"][0]["points"][0];
  EXPECT_LT(smaller["cost"], point["cost"]);
  EXPECT_NE(smaller["error"], point["error"]);
}

TEST_F(BenchSweep, TruthThatShowsNothingIsTold) {
  const fs::path truth = folder_ / "truth";
  fs::copy(Shared("courtyard"), truth, fs::copy_options::recursive);
  fs::remove(truth / "dataset.json");  // from which truth is cast again
  for (const auto& entry : fs::directory_iterator(truth / "depth")) {
    io::WriteExr(entry.path(), Grid<float>(kCourtyardWidthPx, kCourtyardHeightPx));
  }
  ExpectRejected(Dtr({"bench", Shared("cameras.dtr"), "--stage", "stereo", "--max-size", "192",
                      "--truth", truth.string(), "--point", "engine=sgbm", "--renderer", "cpu"}),
                 kFailed, "bench stereo: expected true pixels to score, found none");
}

TEST_F(BenchSweep, StorageByBytes) {
  // A set of the user's that lies where the sweep writes.
  fs::create_directories(folder_ / "out");
  fs::copy(Shared("true.dtr"), folder_ / "out/storage.dtr", fs::copy_options::recursive);
  const auto before = Contents(folder_ / "out/storage.dtr");
  DtrOk({"bench", Shared("true.dtr"), "--stage", "storage", "--renderer", "cpu", "--max-points",
         "2", "-o", (folder_ / "out").string()});
  const Json stage = Json::parse(Text(folder_ / "out/bench.json"))["stages"][0];
  ASSERT_EQ(stage["points"].size(), 2u);
  const Json &inverse = stage["points"][0], &exact = stage["points"][1];
  EXPECT_EQ(inverse["options"]["depth"], "png16-inverse");
  EXPECT_EQ(exact["options"]["depth"], "exr-float");
  EXPECT_GT(exact["cost"], inverse["cost"]);
  // 16 bits of inverse depth are far below what a pixel shows.
  EXPECT_NEAR(exact["error"], inverse["error"], 0.01 * inverse["error"].get<double>());
  EXPECT_EQ(inverse["cost_least"], inverse["cost_most"]);
  EXPECT_TRUE(stage["machine_ms"].is_null());
  EXPECT_TRUE(DifferingFiles(Contents(folder_ / "out/storage.dtr"), before).empty());
  for (const auto& entry : fs::directory_iterator(folder_ / "out")) {
    EXPECT_NE(entry.path().filename().string().front(), '.') << entry.path() << " was left";
  }
}

TEST_F(BenchSweep, StorageAsTheSetLiesAndInFewerBytes) {
  const auto measured = [&](const std::string& point) {
    return Json::parse(DtrOk({"bench", Shared("true.dtr"), "--stage", "storage", "--renderer",
                              "cpu", "--point", point, "--json", "-"})
                           .out)["stages"][0]["points"][0];
  };
  const Json own = measured("default"), bands = measured("depth=zstd-0.125px"),
             coarse = measured("depth=zstd-1px"), jpeg = measured("image=jpeg-95"),
             worse = measured("image=jpeg-70");
  std::uintmax_t bytes = 0;
  for (const char* folder : {"images", "depth", "completed", "sigma", "mask", "mesh"}) {
    if (!fs::exists(fs::path(Shared("true.dtr")) / folder)) continue;
    for (const auto& entry : fs::directory_iterator(fs::path(Shared("true.dtr")) / folder)) {
      bytes += entry.file_size();
    }
  }
  EXPECT_EQ(own["cost"], static_cast<double>(bytes));
  EXPECT_LT(bands["cost"], own["cost"]);
  EXPECT_LT(coarse["cost"], bands["cost"]);
  EXPECT_LT(jpeg["cost"], own["cost"]);
  EXPECT_LT(worse["cost"], jpeg["cost"]);
  EXPECT_NEAR(bands["error"], own["error"], 0.05 * own["error"].get<double>());
  EXPECT_NE(jpeg["error"], own["error"]);
}

TEST_F(BenchSweep, WhatCannotBeMeasuredIsRejected) {
  const auto bench = [](std::vector<std::string> words) {
    words.insert(words.begin(), {"bench", Shared("true.dtr"), "--renderer", "cpu"});
    return Dtr(words);
  };
  ExpectRejected(bench({"--point", "color=red"}), kWrongUsage,
                 "--point: expected default or NAME=VALUE,... with names of "
                 "{method,views,resolution,blend,mesh-tolerance,delta,point-size,exponent,falloff,"
                 "blend-k,max-angle}, found "
                 "'color=red'");
  ExpectRejected(bench({"--point", "resolution=9"}), kWrongUsage,
                 "--point: expected a value of {1,2,4} for resolution, found 'resolution=9'");
  ExpectRejected(bench({"--point", "views=4", "-o", (folder_ / "x").string()}), kWrongUsage,
                 "--point: expected no --output beside it, for one setting writes no folder");
  ExpectRejected(bench({"--point", "default", "--stage", "render,storage"}), kWrongUsage,
                 "--point: expected one --stage with it, found several");
  ExpectRejected(bench({"--budget-ms", "5", "--stage", "storage"}), kWrongUsage,
                 "--budget-ms: expected --stage render with it");
  ExpectRejected(bench({"--max-size", "5"}), kWrongUsage,
                 "--truth, --max-size: expected --stage stereo with them");
  ExpectRejected(bench({"--point", "default", "--table", "report"}), kWrongUsage,
                 "--table excludes --point");
}

TEST_F(BenchSweep, ASweepReplacesNoResultsOfOthers) {
  fs::create_directories(folder_ / "out");
  WriteFileAtomically(folder_ / "out/bench.csv", "mine");
  ExpectRejected(Dtr(Sweep("1")), kWrongUsage, "that is of no unfinished sweep");
  EXPECT_EQ(Text(folder_ / "out/bench.csv"), "mine");
}

}  // namespace
}  // namespace dtr::testing
