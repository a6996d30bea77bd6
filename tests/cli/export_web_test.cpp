// `dtr export --format web`: one file that holds everything, or none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "dtr/io/set_io.h"
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

std::string FromBase64(const std::string& text) {
  std::string bytes;
  unsigned group = 0;
  int bits = 0;
  for (const char c : text) {
    if (c == '=') break;
    const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    group = group << 6 | static_cast<unsigned>(digits.find(c));
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(group >> bits & 255);
  }
  return bytes;
}

std::string Inflated(const std::string& bytes, size_t size) {
  std::string out(size, '\0');
  uLongf filled = static_cast<uLongf>(size);
  EXPECT_EQ(
      uncompress(reinterpret_cast<Bytef*>(out.data()), &filled,
                 reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uLong>(bytes.size())),
      Z_OK);
  EXPECT_EQ(filled, size);
  return out;
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
    const std::string bytes = FromBase64(
        Between(page, "<script type=\"text/plain\" id=\"view-" + std::to_string(sources) + "\">",
                "</script>"));
    ++sources;
    ASSERT_EQ(described["name"], view.name);
    ASSERT_EQ(described["bytes"], bytes.size());
    EXPECT_EQ(described["crc32"], crc32(0, reinterpret_cast<const Bytef*>(bytes.data()),
                                        static_cast<uInt>(bytes.size())));
    EXPECT_EQ(bytes.substr(0, 2), "\xff\xd8");  // a JPEG first
    EXPECT_DOUBLE_EQ(described["camera"][0].get<double>(), view.camera.fx_px());
    const size_t image = described["parts"]["image"][0], depth = described["parts"]["depth"][0];
    const std::string plain = Inflated(bytes.substr(image, depth), described["parts"]["depth"][1]);
    // Each row of validity bits XOR the one above: undone, as many bits as pixels with depth.
    const auto row = static_cast<size_t>(view.depth.width() + 7) / 8;
    std::string bits = plain.substr(0, row * static_cast<size_t>(view.depth.height()));
    long valid = 0;
    for (size_t i = 0; i < bits.size(); ++i) {
      if (i >= row) bits[i] = static_cast<char>(bits[i] ^ bits[i - row]);
      valid += std::popcount(static_cast<unsigned char>(bits[i]));
    }
    const auto& depths = view.depth.grid().data();
    EXPECT_EQ(valid, std::count_if(depths.begin(), depths.end(),
                                   [](float z) { return !DepthImage::IsHole(z); }));
  }
  EXPECT_EQ(json["views"].size(), sources);
  EXPECT_GT(sources, 2u);
}

TEST_F(ExportWeb, NeedsNoOtherFileAndNoServer) {
  DtrOk(Arguments("page.html"));
  const std::string page = Text(folder_ / "page.html");
  for (const char* link : {"src=", "http://", "https://", "import(", "{{", "@import"}) {
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
