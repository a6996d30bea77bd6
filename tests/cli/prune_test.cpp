// `dtr prune` as its users meet it, on a tiny exact set.
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Pruning : public ::testing::Test {
 protected:
  void SetUp() override {
    MakeSmallCourtyard(folder_.path() / "courtyard");
    ImportSmallCourtyard(folder_.path() / "courtyard", folder_ / "set.dtr");
  }
  std::vector<std::string> Arguments(const std::string& output,
                                     const std::string& threads = "2") const {
    return {"prune",
            (folder_ / "set.dtr").string(),
            "-o",
            (folder_ / output).string(),
            "--max-loss-db",
            "1",
            "--probes",
            "5",
            "--checks",
            "6",
            "--renderer",
            "cpu",
            "--threads",
            threads};
  }
  TemporaryFolder folder_;
};

TEST_F(Pruning, KeepsItsPromiseSaysWhatItDidAndIsAnOrdinarySet) {
  const auto before = Contents(folder_ / "set.dtr");
  std::vector<std::string> arguments = Arguments("small.dtr");
  arguments.insert(arguments.end(), {"--json", "-"});
  const Json report = Json::parse(DtrOk(arguments).out);
  EXPECT_THAT(DifferingFiles(before, Contents(folder_ / "set.dtr")), IsEmpty());
  EXPECT_LE(report["loss_db"], 1.0);
  EXPECT_GT(report["bytes_ratio"], 1.5);
  EXPECT_GT(report["frame_ratio"], 0);
  ASSERT_FALSE(report["removed"].empty());

  // The promise, measured by another command: held-out photos, at the set's own settings.
  const std::string set = (folder_ / "set.dtr").string(), small = (folder_ / "small.dtr").string();
  const auto psnr_of = [&](const std::string& which) {
    return Json::parse(DtrOk({"evaluate", which, "--renderer", "cpu", "--json", "-"})
                           .out)["mean"]["psnr_db"]
        .get<double>();
  };
  EXPECT_LE(psnr_of(set) - psnr_of(small), 1.0) << report.dump(1);

  const Ran info = DtrOk({"info", small, "--verify", "--json", (folder_ / "info.json").string()});
  EXPECT_THAT(info.out, HasSubstr("left out by dtr prune"));
  EXPECT_THAT(info.out, HasSubstr(report["removed"][0]["what"].get<std::string>()));
  const Json described = Json::parse(Text(folder_ / "info.json"));
  EXPECT_EQ(described["pruned"]["removed"], report["removed"]);
  EXPECT_EQ(described["pruned"]["render_arguments"], report["render_arguments"]);

  // What the set was pruned for is the default, and can be overridden.
  const auto picture = [&](const std::string& name, std::vector<std::string> more) {
    std::vector<std::string> render = {"render", small,  "--renderer", "cpu",
                                       "--like", "0000", "-o",         (folder_ / name).string()};
    render.insert(render.end(), more.begin(), more.end());
    DtrOk(render);
    return Text(folder_ / name);
  };
  const auto stored = report["render_arguments"].get<std::vector<std::string>>();
  ASSERT_FALSE(stored.empty()) << "a loss of 1 dB allows fewer views a pixel";
  EXPECT_EQ(picture("default.png", {}), picture("explicit.png", stored));
  EXPECT_NE(picture("default.png", {}),
            picture("other.png", {"--views", "1", "--resolution", "4"}));

  // Again: what is pruned can be pruned, written over only when asked, and exported.
  ExpectRejected(Dtr(Arguments("small.dtr")), 2, "pass --force to replace it");
  DtrOk({"export", small, "--format", "colmap", "-o", (folder_ / "colmap").string()});
  DtrOk({"prune", small, "-o", (folder_ / "smaller.dtr").string(), "--max-loss-db", "1", "--probes",
         "2", "--checks", "2", "--renderer", "cpu"});
}

TEST_F(Pruning, GivesTheSameBytesForAnyNumberOfThreadsAndAfterAnInterruption) {
  DtrOk(Arguments("one.dtr", "1"));
  const fs::path partial = folder_ / "two.dtr.partial";
  const Ran cut = Dtr(Arguments("two.dtr"), {SIGINT, [&] { return fs::exists(partial / "work"); }});
  EXPECT_NE(cut.code, 0);
  EXPECT_FALSE(fs::exists(folder_ / "two.dtr"));
  DtrOk(Arguments("two.dtr"));
  EXPECT_THAT(DifferingFiles(Contents(folder_ / "one.dtr"), Contents(folder_ / "two.dtr")),
              IsEmpty());
}

TEST_F(Pruning, RejectsAGoalThatTheLossDoesNotAllow) {
  const std::string set = (folder_ / "set.dtr").string();
  const std::vector<std::string> prune = {
      "prune", set,          "-o", (folder_ / "x.dtr").string(), "--probes", "2", "--checks",
      "1",     "--renderer", "cpu"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), prune.begin(), prune.end());
    return Dtr(more);
  };
  ExpectRejected(with({"--max-bytes", "1000"}), 1,
                 "expected at most 1000 bytes within a loss of 0.1 dB, found");
  EXPECT_FALSE(fs::exists(folder_ / "x.dtr"));
  // What was measured for one goal serves the next.
  ExpectRejected(with({"--frame-ms", "0.001"}), 1, "expected frames of at most");
  // One that is reached at once by what nobody sees ends the rest.
  std::uint64_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(set)) {
    if (entry.is_regular_file()) bytes += entry.file_size();
  }
  DtrOk([&] {
    auto arguments = prune;
    arguments.insert(arguments.end(), {"--max-bytes", std::to_string(2 * bytes), "--json",
                                       (folder_ / "x.json").string()});
    return arguments;
  }());
  EXPECT_LE(Json::parse(Text(folder_ / "x.json"))["removed"].size(), 1u);
}

TEST_F(Pruning, RejectsMeasurementsThatAreNone) {
  std::vector<std::string> arguments = Arguments("cut.dtr");
  const fs::path journal = folder_ / "cut.dtr.partial/work/measured.jsonl";
  (void)Dtr(arguments, {SIGINT, [&] { return fs::exists(journal) && fs::file_size(journal) > 0; }});
  ASSERT_TRUE(fs::exists(journal));
  const std::string kept = Text(journal);
  std::ofstream(journal, std::ios::app) << "no measurement\n";
  ExpectRejected(Dtr(arguments), 1, "expected measurements of dtr prune, found");

  // The names are right, the numbers are gone.
  std::string emptied;
  std::istringstream lines(kept);
  for (std::string line; std::getline(lines, line);) {
    Json entry = Json::parse(line);
    entry["numbers"] = Json::array();
    emptied += entry.dump() + "\n";
  }
  std::ofstream(journal) << emptied;
  ExpectRejected(Dtr(arguments), 1, "numbers, found 0; delete the folder to start over");
  fs::resize_file(journal, (256u << 20) + 1);
  ExpectRejected(Dtr(arguments), 1, "256 MiB of measurements, found");
}

TEST_F(Pruning, RejectsASetWithoutDepth) {
  const std::string plain = (folder_ / "plain.dtr").string();
  DtrOk({"build", (folder_ / "courtyard/images").string(), "-o", plain, "--poses",
         (folder_ / "courtyard/sparse").string(), "--engine", "none"});
  const Ran ran = Dtr({"prune", plain, "-o", (folder_ / "x.dtr").string(), "--renderer", "cpu"});
  ExpectRejected(ran, 1, "expected depth, found none; run dtr stereo first");
}

}  // namespace
}  // namespace dtr::testing
