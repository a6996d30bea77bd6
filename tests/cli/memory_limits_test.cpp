// --memory bounds what input decides: files and options that ask for more, in processes that have
// no more (ulimit -v).
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "tests/cli/courtyard_and_set.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/hostile_images.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::HasSubstr;

class MemoryLimits : public CourtyardAndSet {
 protected:
  /// `dtr WORDS...` with so much address space, which is more than memory: libraries and threads
  /// take some that they never touch.
  Ran DtrWithin(double gb, const std::vector<std::string>& words) const {
    std::string command = "ulimit -v " + std::to_string(static_cast<long>(gb * 1e6)) + "; exec " +
                          std::string(DTR_PROGRAM);
    for (const std::string& word : words) command += " '" + word + "'";
    command += " > '" + In("out") + "' 2> '" + In("err") + "'";
    const int status = std::system(command.c_str());
    Ran ran;
    ran.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    ran.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    ran.out = Text(In("out"));
    ran.err = Text(In("err"));
    return ran;
  }
  /// Cameras of the courtyard, the first of them this large.
  std::string CamerasWithSide(int side, bool alone) const {
    Json cameras = Json::parse(Text(Shared("courtyard/cameras.json")));
    Json& first = cameras["views"][0];
    first["width"] = first["height"] = side;
    first["fx"] = first["fy"] = 0.9 * side;
    first["cx"] = first["cy"] = 0.5 * side;
    if (alone) cameras["views"] = Json::array({first});
    const std::string file = In("cameras" + std::to_string(side) + ".json");
    WriteFileAtomically(file, cameras.dump());
    return file;
  }
  /// Copies of the courtyard's photos, and hostile ones among them.
  fs::path PhotosAndHostileOnes() const {
    fs::path photos = In("photos");
    fs::copy(Photos(), photos, fs::copy_options::recursive);
    for (const int side : {20000, 65535}) {
      WriteFileAtomically(photos / ("z" + std::to_string(side) + ".gif"),
                          HostileGif(side, side, side == 20000));
    }
    const std::string zeros(300'000, '\0');
    WriteFileAtomically(photos / "zpadded.gif", HostileGif(19000, 19000) + zeros);
    return photos;
  }

  static void ExpectTooLarge(const Ran& ran, const std::string& words) {
    ExpectRejected(ran, kFailed, "GB of memory, more than --memory");
    EXPECT_THAT(ran.err, HasSubstr(words));
  }

  static constexpr double kSpaceGb = 2.5;  // of which some 1.2 are the program's
};

TEST_F(MemoryLimits, ImagesFromCameraFiles) {
  const std::string set = Shared("good.dtr"), out = In("image.png");
  for (const char* renderer : {"cpu", "simd"}) {
    const auto render = [&](const std::vector<std::string>& where) {
      std::vector<std::string> words{"render", set, "-o", out, "--renderer", renderer};
      words.insert(words.end(), where.begin(), where.end());
      return DtrWithin(kSpaceGb, words);
    };
    ExpectTooLarge(render({"--camera", CamerasWithSide(10000, true), "--memory", "0.5"}),
                   "cameras10000.json: 0000: rendering 10000x10000 pixels takes 3.2 GB of memory, "
                   "more than --memory 0.5; give more, or a smaller --size");
    ExpectRejected(render({"--camera", CamerasWithSide(65536, true), "--memory", "0.5"}),
                   kWrongUsage, "image: expected at most 2^28 pixels");
    ExpectTooLarge(render({"--like", "0001", "--size", "12000x8000", "--memory", "1"}),
                   "rendering 12000x8000 pixels takes 3.07 GB of memory, more than --memory 1");
  }
  const auto path = [&](const char* output) {
    return DtrWithin(kSpaceGb, {"render", set, "--path", CamerasWithSide(9000, false), "-o",
                                In(output), "--memory", "1"});
  };
  ExpectTooLarge(path("frames"), "cameras9000.json: 0000: rendering 9000x9000 pixels");
  EXPECT_FALSE(fs::exists(In("frames")));
  ExpectTooLarge(path("flight.mp4"), "cameras9000.json: 0000: rendering 9000x9000 pixels");
  EXPECT_FALSE(fs::exists(out));
}

// What a small budget allows is rendered within it.
TEST_F(MemoryLimits, ImagesWithinTheLimitAreRendered) {
  const Ran ran = DtrWithin(kSpaceGb, {"render", Shared("good.dtr"), "--like", "0001", "--size",
                                       "4000x3000", "--memory", "0.5", "-o", In("image.png")});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(io::ReadImageHeader(In("image.png")).width_px, 4000);
}

TEST_F(MemoryLimits, HostileImagesAmongPhotosAreSkippedAndNamed) {
  const fs::path photos = PhotosAndHostileOnes();
  for (const auto& [name, bytes] : HostileImages(0)) WriteFileAtomically(photos / name, bytes);
  const Ran ran = DtrWithin(kSpaceGb, {"capture", photos.string(), "-o", In("capture"), "--memory",
                                       "0.5", "--json", In("capture.json")});
  ASSERT_EQ(ran.code, 0) << ran.err;
  const Json json = Json::parse(Text(In("capture.json")));
  EXPECT_EQ(json["photos"].size(), static_cast<size_t>(kCourtyardViews));
  EXPECT_EQ(json["skipped"].size(), 3 + HostileImages(0).size());
  const auto reason_of = [&](const std::string& name) {
    for (const Json& skipped : json["skipped"]) {
      if (skipped["name"] == name) return skipped["reason"].get<std::string>();
    }
    return std::string();
  };
  EXPECT_THAT(reason_of("z65535.gif"), HasSubstr("expected as many pixels as "));
  EXPECT_THAT(reason_of("zpadded.gif"),
              HasSubstr("reading its 19000x19000 pixels takes 2.89 GB of memory, more than "));
}

TEST_F(MemoryLimits, ABuildSkipsThemAsWell) {
  const Ran ran =
      DtrWithin(kSpaceGb, {"build", PhotosAndHostileOnes().string(), "-o", In("set.dtr"), "--poses",
                           Shared("courtyard/sparse"), "--engine", "none", "--memory", "1",
                           "--json", In("build.json")});
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(Json::parse(Text(In("build.json")))["skipped"].size(), 3U);
}

// A capture whose list says what it likes.
TEST_F(MemoryLimits, PhotosOfACaptureThatAreTooLargeAreSkipped) {
  DtrOk({"capture", Photos(), "-o", In("capture")});
  Json list = Json::parse(Text(In("capture/capture.json")));
  list["photos"][0]["width_px"] = list["photos"][0]["height_px"] = 20000;
  WriteFileAtomically(In("capture/capture.json"), list.dump());
  const Ran ran = DtrWithin(kSpaceGb, {"capture", In("capture"), "-o", In("again"), "--memory", "1",
                                       "--json", In("again.json")});
  ASSERT_EQ(ran.code, 0) << ran.err;
  const Json json = Json::parse(Text(In("again.json")));
  EXPECT_EQ(json["photos"].size(), static_cast<size_t>(kCourtyardViews) - 1);
  EXPECT_EQ(json["skipped"].size(), 1U);
}

TEST_F(MemoryLimits, CamerasAndImagesOfAnImport) {
  const auto import = [&](const std::string& cameras, const std::string& images) {
    return DtrWithin(kSpaceGb, {"import", "--cameras", cameras, "--images", images, "--depth",
                                Shared("courtyard/depth"), "-o", In("set.dtr"), "--memory", "1"});
  };
  ExpectTooLarge(import(CamerasWithSide(20000, false), Photos()),
                 "0000.jpg: a view of 20000x20000 pixels takes 6.4 GB of memory, more than "
                 "--memory 1; give more, or shrink the photos and their cameras");
  // The camera is as it was, its photo is another.
  fs::copy(Photos(), In("images"), fs::copy_options::recursive);
  WriteFileAtomically(In("images/0000.jpg"), HostileGif(19000, 19000) + std::string(300'000, '\0'));
  ExpectTooLarge(import(Shared("courtyard/cameras.json"), In("images")),
                 "0000.jpg: reading its 19000x19000 pixels takes 2.89 GB of memory, more than "
                 "--memory 1; give more, or shrink the image");
  EXPECT_FALSE(fs::exists(In("set.dtr")));
}

// A set that states views which its files do not hold.
TEST_F(MemoryLimits, ViewsOfASetThatAreTooLargeAreLeftOut) {
  fs::copy(Shared("good.dtr"), In("set.dtr"), fs::copy_options::recursive);
  Json set = Json::parse(Text(In("set.dtr/set.json")));
  for (Json& view : set["frames"][0]["views"]) {
    if (view["name"] == "0001.jpg") continue;
    view["camera"]["width_px"] = view["camera"]["height_px"] = 19008;
  }
  WriteFileAtomically(In("set.dtr/set.json"), set.dump());
  const auto render = [&](const std::string& excluded) {
    return DtrWithin(kSpaceGb, {"render", In("set.dtr"), "--like", "0001", "--exclude", excluded,
                                "-o", In(excluded + ".png"), "--memory", "1"});
  };
  const Ran others = render("0002");
  EXPECT_EQ(others.code, 0) << others.err;
  EXPECT_THAT(others.err, HasSubstr("WARNING: drawn from the nearest 1 of "));
  const Ran none = render("0001");
  ExpectRejected(none, kFailed, "views: expected at least one that can be read, found none");
  EXPECT_THAT(none.err, HasSubstr("0002.jpg: reading 19008x19008 pixels takes 8.67 GB of memory"));
  ExpectRejected(DtrWithin(kSpaceGb, {"evaluate", In("set.dtr")}), kFailed,
                 "GB that there are; use a machine with more, or a set of fewer or smaller views");
}

TEST_F(MemoryLimits, AWindow) {
  const Ran ran = Dtr({"view", Shared("good.dtr"), "--size", "16384x16000", "--memory", "1"});
  if (ran.err.find("no command is called") != std::string::npos) GTEST_SKIP() << "no windows";
  ExpectTooLarge(ran, "window: rendering 16384x16000 pixels takes 8.39 GB of memory");
}

}  // namespace
}  // namespace dtr::testing
