// What strangers, full disks and changed inputs must not bring about.
#include <sys/wait.h>

#include <cstdlib>

#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "tests/calib/colmap/fake_colmap.h"
#include "tests/cli/courtyard_and_set.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// Runs `dtr WORDS` with standard output into `out`.
Ran DtrInto(const std::string& words, const fs::path& out, const fs::path& err) {
  const std::string command =
      std::string(DTR_PROGRAM) + " " + words + " > " + out.string() + " 2> " + err.string();
  const int status = std::system(command.c_str());
  Ran ran;
  ran.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  ran.err = Text(err);
  return ran;
}

class Hostile : public CourtyardAndSet {
 protected:
  static fs::path Good() { return *shared_ / "good.dtr"; }

  // A build that gets as far as COLMAP, which fails: what it began stays for the next run.
  Ran BeginBuild(const std::string& photos, std::vector<std::string> further = {}) {
    further.insert(further.begin(),
                   {"build", photos, "-o", In("set.dtr"), "--engine", "none", "--sfm", "colmap"});
    return Dtr(further);
  }
};

TEST_F(Hostile, NamesInASetNeverLeadOutOfTheFolderOfAnExport) {
  const std::string text = Text(Good() / "set.json");
  const std::string field = "\"name\": \"0000.jpg\"";
  ASSERT_NE(text.find(field), std::string::npos);
  for (const std::string& name : {In("abs/x.jpg"), std::string("../../x.jpg")}) {
    fs::remove_all(folder_ / "bad.dtr");
    fs::copy(Good(), folder_ / "bad.dtr", fs::copy_options::recursive);
    std::string bad = text;
    bad.replace(text.find(field), field.size(), "\"name\": \"" + name + "\"");
    WriteFileAtomically(folder_ / "bad.dtr/set.json", bad);
    fs::create_directories(folder_ / "below");
    ExpectRejected(Dtr({"export", In("bad.dtr"), "--format", "colmap", "-o", In("below/out")}),
                   kFailed, "name: expected the photo's name, a relative path inside its folder");
    EXPECT_EQ(FilesIn(folder_ / "below"), 0);
    EXPECT_FALSE(fs::exists(folder_ / "abs"));
    EXPECT_FALSE(fs::exists(folder_ / "x.jpg"));
  }
  std::string moved = text;
  moved.replace(text.find(field), field.size(), "\"name\": \"cam0/0000.jpg\"");
  WriteFileAtomically(folder_ / "bad.dtr/set.json", moved);
  DtrOk({"export", In("bad.dtr"), "--format", "colmap", "-o", In("out")});
  EXPECT_EQ(FilesIn(folder_ / "out/images/cam0"), 1);
}

TEST_F(Hostile, AResultThatCannotBeToldIsAFailure) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  const std::string set = Good().string();
  for (const std::string& words :
       {"info " + set + " --json -", "info " + set, std::string("dataset list --json -"),
        std::string("completion"), std::string("--version"), std::string("build --help")}) {
    ExpectRejected(DtrInto(words, "/dev/full", In("err")), kFailed,
                   "standard output: cannot be written: No space left on device");
    const Ran fits = DtrInto(words, In("out"), In("err"));
    EXPECT_EQ(fits.err.find("cannot be written"), std::string::npos) << words;
    EXPECT_FALSE(Text(In("out")).empty()) << words;
  }
}

TEST_F(Hostile, ArgumentsThatJsonCannotHoldAreRejectedBeforeAnyWork) {
  const std::string name = In("caf\xe9\n.dtr");
  const Ran ran = Dtr({"build", Photos(), "-o", name});
  ExpectRejected(ran, kWrongUsage, "expected UTF-8, found");
  EXPECT_THAT(ran.err, HasSubstr("caf??.dtr'; rename"));  // on one line
  EXPECT_EQ(FilesIn(folder_.path()), 0);
}

// What other commands make under the name that a build was to have is not written over its work.
TEST_F(Hostile, AnInterruptedBuildIsNotTakenForACapture) {
  const std::string photos = Photos();
  {
    colmap::testing::FakeColmap colmap;
    colmap.Fail("feature_extractor", "exit 3");
    EXPECT_EQ(BeginBuild(photos).code, kFailed);
  }
  const auto before = Contents(folder_ / "set.dtr.partial");
  ASSERT_FALSE(before.empty());
  const std::pair<std::string, std::vector<std::string>> others[] = {
      {"capture", {"capture", photos}},
      {"dataset", {"dataset", "make", "plane"}},
      {"dataset", {"dataset", "convert", "fern", photos}},
      {"export", {"export", Good().string(), "--format", "colmap"}}};
  for (auto [kind, words] : others) {
    words.insert(words.end(), {"-o", In("set.dtr")});
    ExpectRejected(
        Dtr(words), kWrongUsage,
        "expected nothing or an unfinished " + kind + ", found something else; move it away");
    EXPECT_EQ(Contents(folder_ / "set.dtr.partial"), before) << kind;
    EXPECT_FALSE(fs::exists(folder_ / "set.dtr")) << kind;
  }
}

TEST_F(Hostile, APhotoEditedInACaptureIsAnotherInput) {
  const std::string capture = In("capture");
  DtrOk({"capture", Photos(), "-o", capture});
  colmap::testing::FakeColmap colmap;
  colmap.Fail("feature_extractor", "exit 3");
  const std::string others = "expected work of the same inputs and options, found others";
  EXPECT_EQ(BeginBuild(capture).code, kFailed);
  EXPECT_EQ(BeginBuild(capture).err.find(others), std::string::npos);  // the same goes on
  ChangePhoto(folder_ / "capture/images/0002.jpg");
  ExpectRejected(BeginBuild(capture), kWrongUsage, others);
}

TEST_F(Hostile, MemoryThatChangesTheFeaturesIsAnotherInput) {
  fs::create_directories(folder_ / "photos");
  for (const auto& [name, grey] : {std::pair("photos/0000.jpg", 90), {"photos/0001.jpg", 120}}) {
    io::WriteImage(folder_ / name, ImageRgb8(2400, 1800, 3, static_cast<std::uint8_t>(grey)));
  }
  // Known poses need features too, for the points.
  std::string cameras = Text(*shared_ / "courtyard/cameras.json");
  for (const auto& [small, large] : {std::pair("\"width\": 192", "\"width\": 2400"),
                                     std::pair("\"height\": 128", "\"height\": 1800")}) {
    ASSERT_NE(cameras.find(small), std::string::npos);
    for (size_t at; (at = cameras.find(small)) != std::string::npos;) {
      cameras.replace(at, std::string(small).size(), large);
    }
  }
  WriteFileAtomically(folder_ / "cameras.json", cameras);
  colmap::testing::FakeColmap colmap;
  colmap.Fail("feature_extractor", "exit 3");
  const std::string others = "expected work of the same inputs and options, found others";
  for (const std::vector<std::string>& poses :
       {std::vector<std::string>{}, {"--poses", In("cameras.json")}}) {
    const auto begin = [&](const std::string& memory_gb) {
      std::vector<std::string> further = poses;
      further.insert(further.end(), {"--memory", memory_gb});
      return BeginBuild(In("photos"), further);
    };
    EXPECT_EQ(begin("4").code, kFailed);
    EXPECT_EQ(begin("3.9").err.find(others), std::string::npos);
    ExpectRejected(begin("0.5"), kWrongUsage, others);
    fs::remove_all(folder_ / "set.dtr.partial");
  }
}

TEST_F(Hostile, WhatScreeningSeesIsSaid) {
  fs::copy(*shared_ / "courtyard", folder_ / "c", fs::copy_options::recursive);
  // A photo of the right size that shows nothing but white.
  io::WriteImage(folder_ / "c/images/0003.jpg",
                 ImageRgb8(kCourtyardWidthPx, kCourtyardHeightPx, 3, 255));
  const Ran ran = DtrOk({"build", In("c/images"), "-o", In("set.dtr"), "--poses", In("c/sparse"),
                         "--engine", "none", "--json", "-"});
  EXPECT_THAT(ran.err, HasSubstr("screening: 1 of 7 photos have a remark and are used, first "
                                 "0003.jpg: "));
  EXPECT_THAT(ran.out, HasSubstr("\"screening\": [\n  {\n   \"name\": \"0003.jpg\""));
  EXPECT_THAT(Text(In("set.dtr/report/run.json")), HasSubstr("0003.jpg"));
}

}  // namespace
}  // namespace dtr::testing
