// `dtr export --format web`: one file that holds everything, or none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "dtr/base/process.h"
#include "dtr/io/set_io.h"
#include "dtr/render/scene.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

// What stands between two marks.
std::string Between(const std::string& text, const std::string& start, const std::string& end) {
  const size_t first = text.find(start);
  if (first == std::string::npos) return "";
  const size_t from = first + start.size();
  return text.substr(from, text.find(end, from) - from);
}

// A set with true depth.
class ExportWeb : public ::testing::Test {
 protected:
  void SetUp() override {
    MakeSmallCourtyard(folder_ / "courtyard");
    ImportSmallCourtyard(folder_ / "courtyard", folder_ / "set.dtr");
  }
  std::vector<std::string> Arguments(const std::string& name,
                                     const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments = {"export",   (folder_ / "set.dtr").string(),
                                          "--format", "web",
                                          "-o",       (folder_ / name).string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  // Nothing but the courtyard and its set.
  void ExpectNothingLeft() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      names.push_back(entry.path().filename().string());
    }
    EXPECT_THAT(names, ::testing::UnorderedElementsAre("courtyard", "set.dtr"));
  }

  TemporaryFolder folder_;
};

// What the page's own modules find in it (node).
nlohmann::json Decoded(const fs::path& page) {
  std::string out;
  ProcessOptions options;
  options.on_line = [&](const std::string& line) { out += line + "\n"; };
  EXPECT_TRUE(RunProcess({"node", DTR_DECODE_PAGE, page.string(), DTR_VIEWER_WEB}, options).Ok())
      << out;
  return nlohmann::json::parse(out, nullptr, false);
}

TEST_F(ExportWeb, HoldsEveryViewWithItsChecksumAndDepth) {
  if (FindProgram("node").empty()) GTEST_SKIP() << "needs node";
  DtrOk(Arguments("page.html"));
  const nlohmann::json found = Decoded(folder_ / "page.html");
  const DtrSet set = io::LoadSet(folder_ / "set.dtr");
  size_t sources = 0;
  for (const View& view : set.frames[0].views) {
    if (view.role != ViewRole::kSource) continue;
    ASSERT_LT(sources, found.size());
    const auto& read = found[sources++];
    EXPECT_EQ(read["name"], view.name);
    EXPECT_EQ(read["crc"], true);
    EXPECT_EQ(read["jpeg"], true);
    EXPECT_EQ(read["cut"], 4);  // of four damaged ones
    long valid = 0;
    double inverse = 0;
    for (const float z : view.depth.grid().data()) {
      if (DepthImage::IsHole(z)) continue;
      ++valid;
      inverse += 1 / static_cast<double>(z);
    }
    EXPECT_EQ(read["measured"], valid);
    // Steps of 0.3 px of disparity: one code off would be 0.3, half of one 0.15; on planes of few
    // samples rounding leaves a few hundredths.
    const double pixel = 1 / (view.camera.fx_px() * DisparityBaseline(view));
    EXPECT_NEAR(read["inverse"].get<double>() / static_cast<double>(valid),
                inverse / static_cast<double>(valid), 0.05 * pixel);
  }
  EXPECT_EQ(found.size(), sources);
  EXPECT_GT(sources, 2u);
}

TEST_F(ExportWeb, NeedsNoOtherFileAndNoServer) {
  DtrOk(Arguments("page.html"));
  const std::string page = Text(folder_ / "page.html");
  for (const char* link : {"src=", "http://", "https://", "import(", "{{script", "{{set",
                           "{{shaders", "{{style", "{{title", "{{version", "{{views", "@import"}) {
    EXPECT_THAT(page, Not(HasSubstr(link))) << link;
  }
  const std::string script = Between(page, "id=\"script\">", "</script>");
  for (const char* line : {"\nimport ", "\nexport "}) EXPECT_THAT(script, Not(HasSubstr(line)));
  EXPECT_THAT(script, HasSubstr("class Renderer"));
}

TEST_F(ExportWeb, IsTheSameEachTime) {
  DtrOk(Arguments("a.html", {"--threads", "1"}));
  DtrOk(Arguments("b.html", {"--threads", "3"}));
  EXPECT_EQ(Text(folder_ / "a.html"), Text(folder_ / "b.html"));
}

TEST_F(ExportWeb, AFileThatExistsIsNotReplaced) {
  WriteFileAtomically(folder_ / "page.html", "notes");
  ExpectRejected(Dtr(Arguments("page.html")), kWrongUsage, "exists already; choose another name");
  EXPECT_EQ(Text(folder_ / "page.html"), "notes");
}

TEST_F(ExportWeb, FitsTheSizeThatIsAskedFor) {
  DtrOk(Arguments("whole.html"));
  const auto whole = fs::file_size(folder_ / "whole.html");
  const auto limit = static_cast<std::uintmax_t>(0.9 * static_cast<double>(whole));
  DtrOk(Arguments("small.html", {"--max-mb", std::to_string(static_cast<double>(limit) / 1e6)}));
  EXPECT_LE(fs::file_size(folder_ / "small.html"), limit);
}

TEST_F(ExportWeb, APageThatCannotBeSoSmallSaysTheLeastThatCan) {
  const Ran ran = Dtr(Arguments("page.html", {"--max-mb", "0.01"}));
  ExpectRejected(ran, kFailed, "the smallest page of this set takes");
  EXPECT_THAT(ran.err, HasSubstr("--max-mb 0.01"));
  ExpectNothingLeft();
  // What it says is true.
  const std::string least = Between(ran.err, "of this set takes ", " MB");
  DtrOk(Arguments("page.html", {"--max-mb", least}));
}

TEST_F(ExportWeb, ASetWithoutDepthHasNoPage) {
  const fs::path set = folder_ / "flat.dtr";
  DtrOk({"import", "--cameras", (folder_ / "courtyard/cameras.json").string(), "--images",
         (folder_ / "courtyard/images").string(), "-o", set.string()});
  ExpectRejected(
      Dtr({"export", set.string(), "--format", "web", "-o", (folder_ / "page.html").string()}),
      kFailed, "has no depth; `dtr stereo` makes it");
  EXPECT_FALSE(fs::exists(folder_ / "page.html"));
}

TEST_F(ExportWeb, OptionsOfAnotherFormatAreRejected) {
  ExpectRejected(Dtr(Arguments("page.html", {"--text"})), kWrongUsage,
                 "--text needs --format colmap, found --format web; leave one of them out");
  ExpectRejected(Dtr({"export", (folder_ / "set.dtr").string(), "--max-mb", "4", "-o",
                      (folder_ / "out").string()}),
                 kWrongUsage, "--max-mb needs --format web, found --format colmap");
  ExpectNothingLeft();
}

}  // namespace
}  // namespace dtr::testing
