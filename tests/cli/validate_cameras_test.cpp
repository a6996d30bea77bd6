// `dtr validate CAMERAS --images PHOTOS`: right, wrong and why, or not decidable.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <utility>

#include "dtr/io/image_io.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr int kUndecided = 3;

class ValidateCameras : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = new TemporaryFolder;
    MakeSmallCourtyard(shared_->path() / "courtyard");
  }
  static void TearDownTestSuite() {
    delete shared_;
    shared_ = nullptr;
  }
  static std::string Of(const std::string& name) {
    return (*shared_ / "courtyard" / name).string();
  }

  /// The true cameras with a change.
  std::string Changed(const std::function<void(Json& views)>& change) const {
    Json list = Json::parse(Text(Of("cameras.json")));
    change(list["views"]);
    const fs::path file = folder_ / "cameras.json";
    std::ofstream(file) << list;
    return file.string();
  }
  /// Runs it; expects that the JSON and the last line start with the answer that the code means.
  std::string Answer(const std::string& cameras, int code) const {
    const Ran ran = Dtr({"validate", cameras, "--images", Of("images"), "--json", "-"});
    EXPECT_EQ(ran.code, code) << ran.err;
    if (ran.code != code) return "";
    const Json json = Json::parse(ran.out);
    const std::string answer = json["answer"], conclusion = json["conclusion"];
    EXPECT_EQ(answer, code == 0 ? "right" : code == kFailed ? "wrong" : "not decidable");
    EXPECT_THAT(conclusion, StartsWith(answer + ": "));
    EXPECT_THAT(ran.err, HasSubstr(conclusion + "\n"));
    return conclusion;
  }

  const TemporaryFolder folder_;

 private:
  inline static TemporaryFolder* shared_ = nullptr;
};

TEST_F(ValidateCameras, RightOnesAreRightAndNothingIsWritten) {
  const auto before = Contents(Of(""));
  EXPECT_THAT(Answer(Of("cameras.json"), 0), HasSubstr("95 % of what 7 photos show lies within"));
  EXPECT_THAT(Answer(Of("sparse"), 0), HasSubstr("7 photos"));
  EXPECT_EQ(Contents(Of("")), before);
}

TEST_F(ValidateCameras, WrongOnesAreNamedWithWhatToDo) {
  EXPECT_THAT(Answer(Changed([](Json& views) {
                       for (Json& view : views) {
                         for (int row : {1, 2}) {
                           for (Json& number : view["cam_from_world"][row])
                             number = -number.get<double>();
                         }
                       }
                     }),
                     kFailed),
              HasSubstr("with OpenGL's axes"));
  EXPECT_THAT(Answer(Changed([](Json& views) {
                       for (Json& view : views) {
                         for (const char* name : {"fx", "fy"})
                           view[name] = 1.15 * view[name].get<double>();
                       }
                     }),
                     kFailed),
              HasSubstr("f_px: stored 171.7"));
  EXPECT_THAT(Answer(Changed([](Json& views) {
                       std::swap(views[2]["cam_from_world"], views[3]["cam_from_world"]);
                     }),
                     kFailed),
              ContainsRegex("camera_.*000[23]\\.jpg"));
}

TEST_F(ValidateCameras, TwoPhotosDecideNothing) {
  EXPECT_THAT(Answer(Changed([](Json& views) {
                       views = Json{views[2], views[3]};
                     }),
                     kUndecided),
              HasSubstr("too_few_views: 2 images: nothing can be held out"));
}

// Photos of one colour each have no features.
TEST_F(ValidateCameras, PhotosThatShowNothingDecideNothing) {
  fs::create_directories(folder_ / "plain");
  for (int i = 0; i < kCourtyardViews; ++i) {
    ImageRgb8 plain(kCourtyardWidthPx, kCourtyardHeightPx, 3);
    std::fill(plain.data().begin(), plain.data().end(), static_cast<std::uint8_t>(100 + i));
    io::WriteImage(folder_ / "plain" / fmt::format("000{}.jpg", i), plain);
  }
  const Ran ran = Dtr(
      {"validate", Of("cameras.json"), "--images", (folder_ / "plain").string(), "--json", "-"});
  EXPECT_EQ(ran.code, kUndecided) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("\"answer\": \"not decidable\""));
  EXPECT_THAT(ran.err, HasSubstr("not decidable: expected photos that show the same points"));
}

TEST_F(ValidateCameras, OptionsOfBoardsAreRejected) {
  ExpectRejected(Dtr({"validate", Of("cameras.json"), "--images", Of("images"), "--board",
                      "chessboard:9x6:25mm"}),
                 kWrongUsage, "are for calibrations of boards, not for cameras of photos");
}

TEST_F(ValidateCameras, WithoutTheirPhotosOneLineSaysSo) {
  ExpectRejected(Dtr({"validate", Of("cameras.json")}), kWrongUsage,
                 "expected the folder of the images");
  ExpectRejected(Dtr({"validate", Of("images"), "--images", Of("images")}), kFailed,
                 "not recognised, the folder holds no cameras.bin");
}

}  // namespace
}  // namespace dtr::testing
