// `dtr prune` in its shortest form: one goal that few steps reach. prune_test.cpp has the rest.
#include <nlohmann/json.hpp>

#include "cli/render_arguments.h"
#include "dtr/render/stored_options.h"
#include "tests/support/small_courtyard_set.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::HasSubstr;

class QuickPruning : public SmallCourtyardSet {};

std::uintmax_t BytesBelow(const fs::path& folder) {
  std::uintmax_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) bytes += entry.file_size();
  }
  return bytes;
}

TEST_F(QuickPruning, ASmallerSetIsDescribedVerifiedAndDrawnAsItWasPrunedFor) {
  const auto before = Contents(Set());
  const std::string small = In("small.dtr");
  const Json report =
      Json::parse(DtrOk({"prune", Set(), "-o", small, "--max-loss-db", "3", "--max-bytes",
                         std::to_string(BytesBelow(Set()) * 6 / 10), "--probes", "1", "--checks",
                         "1", "--renderer", "cpu", "--json", "-"})
                      .out);
  EXPECT_EQ(Contents(Set()), before);
  ASSERT_FALSE(report["removed"].empty());
  EXPECT_LE(report["loss_db"], 3.0);
  EXPECT_GT(report["bytes_ratio"], 1.2);
  EXPECT_LT(BytesBelow(small), BytesBelow(Set()));

  const Ran info = DtrOk({"info", small, "--verify"});
  EXPECT_THAT(info.out, HasSubstr("left out by dtr prune"));
  for (const Json& removal : report["removed"]) {
    EXPECT_THAT(info.out, HasSubstr(removal["what"].get<std::string>()));
  }
  for (const Json& step : report["put_back"]) {
    EXPECT_THAT(info.out, HasSubstr("taken back: " + step["kind"].get<std::string>() + ": " +
                                    step["what"].get<std::string>()));
  }
  EXPECT_THAT(info.out, HasSubstr("lost between input cameras: "));
  EXPECT_THAT(info.out, HasSubstr("lost at photos that did not decide: "));
  EXPECT_THAT(info.out, HasSubstr("verified: every file"));

  const auto picture = [&](const std::string& name, std::vector<std::string> more) {
    std::vector<std::string> words = {"render", small,    "--renderer", "cpu", "--size",
                                      "48x0",   "--like", "0000",       "-o",  In(name)};
    words.insert(words.end(), more.begin(), more.end());
    DtrOk(words);
    return Text(In(name));
  };
  const std::string drawn = picture("default.png", {});
  EXPECT_EQ(drawn, picture("explicit.png", cli::RenderOptionArguments(WithStoredOptions(
                                               {}, report["render"].dump(), "report"))));
  EXPECT_NE(drawn, picture("other.png", {"--views", "1", "--resolution", "4"}));
}

}  // namespace
}  // namespace dtr::testing
