// `dtr export --format web`: one file that holds everything, or none.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "dtr/io/set_io.h"
#include "dtr/render/scene.h"
#include "dtr/types/inverse_depth_code.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/cli/web_page_bytes.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kDepthErrorPx = 0.1501;  // 0.15 and what float depths add

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

// Every depth is there, and off by no more than docs/EXPORT.md says.
void ExpectDepth(const View& view, const nlohmann::json& range, const Grid<std::uint16_t>& codes) {
  const InverseDepthCode code(range["near_z"], range["far_z"], range["steps"]);
  const double pixel = ThresholdsOf(view, {}).pixel;
  double worst_px = 0;
  for (int y = 0; y < codes.height(); ++y) {
    for (int x = 0; x < codes.width(); ++x) {
      const float z = view.depth(x, y);
      ASSERT_EQ(codes(x, y) == 0, DepthImage::IsHole(z)) << x << " " << y;
      if (codes(x, y) == 0) continue;
      const double error = 1 / static_cast<double>(code.Decode(codes(x, y))) - 1.0 / z;
      worst_px = std::max(worst_px, std::abs(error) / pixel);
    }
  }
  EXPECT_LT(worst_px, kDepthErrorPx);
}

TEST_F(ExportWeb, HoldsEveryViewWithItsChecksumAndDepth) {
  DtrOk(Arguments("page.html"));
  const std::string page = Text(folder_ / "page.html");
  const auto json = nlohmann::json::parse(
      Between(page, "<script type=\"application/json\" id=\"set\">", "</script>"));
  const DtrSet set = io::LoadSet(folder_ / "set.dtr");
  size_t sources = 0;
  for (const View& view : set.frames[0].views) {
    if (view.role != ViewRole::kSource) continue;
    const auto& described = json["views"][sources];
    const std::string bytes = BytesOfText(
        Between(page, "<script type=\"text/plain\" id=\"view-" + std::to_string(sources) + "\">",
                "</script>"),
        described["bytes"]);
    ++sources;
    ASSERT_EQ(described["name"], view.name);
    EXPECT_EQ(described["crc32"], crc32(0, reinterpret_cast<const Bytef*>(bytes.data()),
                                        static_cast<uInt>(bytes.size())));
    EXPECT_EQ(bytes.substr(0, 2), "\xff\xd8");  // a JPEG first
    EXPECT_DOUBLE_EQ(described["camera"][0].get<double>(), view.camera.fx_px());
    const auto& parts = described["parts"];
    const size_t image = parts["image"], places = parts["depth_places"], depth = parts["depth"];
    const Grid<std::uint16_t> codes =
        DecodedMap(bytes.substr(image, places), bytes.substr(image + places, depth),
                   view.depth.width(), view.depth.height());
    ExpectDepth(view, described["depth"], codes);
  }
  EXPECT_EQ(json["views"].size(), sources);
  EXPECT_GT(sources, 2u);
}

TEST_F(ExportWeb, HoldsTheFiguresOfHeldOutPhotos) {
  const auto value_of = [&](const std::string& page, const std::string& name) {
    const auto json = nlohmann::json::parse(Between(
        Text(folder_ / page), "<script type=\"application/json\" id=\"set\">", "</script>"));
    for (const auto& figure : json["figures"]) {
      if (figure[0] == name) return figure[1].get<std::string>();
    }
    return std::string("none");
  };
  DtrOk(Arguments("page.html"));
  const Ran ran = Dtr({"evaluate", (folder_ / "set.dtr").string(), "--json", "-"});
  const auto mean = nlohmann::json::parse(ran.out)["mean"];
  EXPECT_EQ(value_of("page.html", "their PSNR"),
            fmt::format("{:.2f} dB", mean["psnr_db"].get<double>()));
  EXPECT_EQ(value_of("page.html", "held-out photos"), "2");
  EXPECT_EQ(value_of("page.html", "calibration"), "not validated");
  DtrOk(Arguments("quick.html", {"--no-evaluate"}));
  EXPECT_EQ(value_of("quick.html", "their PSNR"), "none");
}

TEST_F(ExportWeb, NeedsNoOtherFileAndNoServer) {
  DtrOk(Arguments("page.html"));
  // The views' bytes can spell anything.
  const std::string page = Between(Text(folder_ / "page.html"), "", "id=\"view-0\"");
  for (const char* link : {"src=", "http://", "https://", "import(", "{{", "@import"}) {
    EXPECT_EQ(page.find(link), std::string::npos) << link;
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

TEST_F(ExportWeb, AFolderIsASiteOfTheSameViews) {
  DtrOk(Arguments("page.html"));
  DtrOk(Arguments("site"));
  const std::string page = Text(folder_ / "page.html");
  const auto json = nlohmann::json::parse(
      Between(page, "<script type=\"application/json\" id=\"set\">", "</script>"));
  EXPECT_EQ(nlohmann::json::parse(Text(folder_ / "site/set.json")), json);
  for (size_t i = 0; i < json["views"].size(); ++i) {
    const std::string number = std::to_string(i);
    EXPECT_EQ(Text(folder_ / ("site/view-" + number + ".bin")),
              BytesOfText(Between(page, "id=\"view-" + number + "\">", "</script>"),
                          json["views"][i]["bytes"]));
  }
  EXPECT_THAT(Text(folder_ / "site/index.html"), Not(HasSubstr("{{")));
  EXPECT_THAT(Text(folder_ / "site/dtr-viewer.js"), HasSubstr("\nexport async function openPage("));
  EXPECT_THAT(Text(folder_ / "site/dtr-viewer.js"), Not(HasSubstr("\nimport {")));
  ExpectRejected(Dtr(Arguments("site")), kWrongUsage, "exists already; choose another name");
  // A site is as small as is asked for, too.
  double whole = 0;
  for (const auto& entry : fs::directory_iterator(folder_ / "site")) {
    whole += static_cast<double>(entry.file_size());
  }
  DtrOk(Arguments("small/", {"--max-mb", std::to_string(0.9 * whole / 1e6), "--no-evaluate"}));
  double small = 0;
  for (const auto& entry : fs::directory_iterator(folder_ / "small")) {
    small += static_cast<double>(entry.file_size());
  }
  EXPECT_LE(small, 0.9 * whole);
}

TEST_F(ExportWeb, APageIsHtmlOrAFolder) {
  ExpectRejected(Dtr(Arguments("page.pdf")), kWrongUsage, "expected a name ending in");
  ExpectNothingLeft();
}

TEST_F(ExportWeb, FitsTheSizeThatIsAskedFor) {
  DtrOk(Arguments("whole.html"));
  const auto whole = fs::file_size(folder_ / "whole.html");
  const auto limit = static_cast<std::uintmax_t>(0.9 * static_cast<double>(whole));
  DtrOk(Arguments("small.html", {"--max-mb", std::to_string(static_cast<double>(limit) / 1e6)}));
  EXPECT_LE(fs::file_size(folder_ / "small.html"), limit);
}

// Where nothing may be left out; export_web_prune_test has the other case.
TEST_F(ExportWeb, APageThatCannotBeSoSmallSaysTheLeastThatCan) {
  const Ran ran = Dtr(Arguments("page.html", {"--max-mb", "0.01", "--no-evaluate"}));
  ExpectRejected(ran, kFailed, "the smallest page of this set takes");
  EXPECT_THAT(ran.err, HasSubstr("--max-mb 0.01"));
  ExpectNothingLeft();
  // What it says is true.
  const std::string least = Between(ran.err, "of this set takes ", " MB");
  DtrOk(Arguments("page.html", {"--max-mb", least, "--no-evaluate"}));
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
