// Input that cannot work: one clear line, the right exit code, nothing left behind half-written.
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "tests/calib/colmap/fake_colmap.h"
#include "tests/cli/courtyard_and_set.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/environment.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class BadInput : public CourtyardAndSet {
 protected:
  // `dtr build` into set.dtr with these arguments after the photos.
  Ran Build(const std::string& photos, std::vector<std::string> further = {}) {
    further.insert(further.begin(), {"build", photos, "-o", In("set.dtr"), "--sfm", "colmap"});
    return Dtr(further);
  }
  void ExpectNothingBuilt() {
    EXPECT_FALSE(fs::exists(In("set.dtr")));
    EXPECT_FALSE(fs::exists(In("set.dtr.partial")));
  }
  // A copy of the good set, to be damaged.
  fs::path Copy(const std::string& name = "bad.dtr") {
    fs::remove_all(folder_ / name);
    fs::copy(Shared("good.dtr"), folder_ / name, fs::copy_options::recursive);
    return folder_ / name;
  }
  // The run of `dtr info` after replacing the first `from` in set.json.
  Ran InfoAfter(const std::string& from, const std::string& to) {
    const fs::path set = Copy();
    std::string text = Text(set / "set.json");
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    WriteFileAtomically(set / "set.json", text.replace(at, from.size(), to));
    return Dtr({"info", set.string()});
  }
  Ran Render(std::vector<std::string> further) {
    further.insert(further.begin(), {"render", Shared("good.dtr"), "--renderer", "cpu"});
    return Dtr(further);
  }
};

TEST_F(BadInput, FoldersWithoutEnoughPhotos) {
  fs::create_directories(folder_ / "photos");
  ExpectRejected(Build(In("photos")), kFailed, "expected photos, found none");
  fs::copy(Photos() + "/0000.jpg", In("photos"));
  ExpectRejected(Build(In("photos")), kFailed, "expected at least 2 photos, found 1");
  ExpectRejected(Build(In("absent")), kWrongUsage, "expected a folder of photos, found nothing");
  ExpectRejected(Build(Photos() + "/0000.jpg"), kWrongUsage,
                 "expected a folder of photos, found something else");
  ExpectNothingBuilt();
}

TEST_F(BadInput, ALensFileIsReadBeforeAnyPhoto) {
  // The folder has no photo: reading it first would say that.
  fs::create_directories(folder_ / "photos");
  const auto calibrate = [&](const std::string& lens) {
    return Dtr({"calibrate", "photos", In("photos"), "-o", In("calibration"), "--lens", In(lens)});
  };
  WriteFileAtomically(In("lens.json"), "{}");
  ExpectRejected(calibrate("lens.json"), kFailed, "format: expected a string, found nothing");
  WriteFileAtomically(In("lens.ini"), "");
  ExpectRejected(calibrate("lens.ini"), kWrongUsage, "expected a .json of `dtr calibrate board`");
  EXPECT_FALSE(fs::exists(In("calibration")));
}

TEST_F(BadInput, ATextFileAmongThePhotosIsSkippedAndNamed) {
  fs::copy(Photos(), In("photos"));
  WriteFileAtomically(In("photos/notes.jpg"), "Sunny day, 14 photos.\n");
  WriteFileAtomically(In("photos/notes.txt"), "No image extension: ignored.\n");
  const Ran ran = Build(In("photos"), {"--poses", Shared("courtyard/sparse"), "--engine", "none",
                                       "--json", In("build.json")});
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("skipped: notes.jpg: "));
  const Json skipped = Json::parse(Text(In("build.json")))["skipped"];
  ASSERT_EQ(skipped.size(), 1u);
  EXPECT_EQ(skipped[0]["name"], "notes.jpg");
  EXPECT_NE(skipped[0]["reason"], "");
}

TEST_F(BadInput, ColmapThatIsAbsentOrFails) {
  {
    const Environment path("PATH", In("bin"));
    ExpectRejected(Build(Photos()), kFailed, "colmap: program not found on the PATH");
    ExpectRejected(Build(Photos(), {"--poses", Shared("courtyard/cameras.json")}), kFailed,
                   "colmap: program not found on the PATH");
    ExpectNothingBuilt();
  }
  ExpectRejected(Build(Photos(), {"--features", "9000"}), kWrongUsage,
                 "--features 9000: expected at most 8192, the limit of --sfm colmap");
  colmap::testing::FakeColmap colmap;
  colmap.Fail("feature_extractor", "echo full; exit 3");
  ExpectRejected(
      Build(Photos()), kFailed,
      "colmap feature_extractor (features): expected exit code 0, found 3: last line: full");
  EXPECT_FALSE(fs::exists(In("set.dtr")));
}

TEST_F(BadInput, PhotosWithNothingInCommon) {
  colmap::testing::FakeColmap colmap;  // its mapper leaves no model
  // Photos are numbered for COLMAP, whatever their names.
  colmap.LeaveDatabase({"000000.jpg", "000001.jpg", "000002.jpg", "000003.jpg", "000004.jpg",
                        "000005.jpg", "000006.jpg"});
  ExpectRejected(Build(Photos()), kFailed, "found that they have too little in common");
  EXPECT_FALSE(fs::exists(In("set.dtr")));
}

TEST_F(BadInput, CameraGroupsOfKnownCameras) {
  for (const char* known : {"--poses", "--rig"}) {
    ExpectRejected(
        Build(Photos(), {"--camera-per", "set", known, Shared("courtyard/cameras.json")}),
        kWrongUsage, "--camera-per: says which photos share intrinsics that SfM finds");
  }
  EXPECT_FALSE(fs::exists(In("set.dtr")));
}

TEST_F(BadInput, OutputsThatExistOrCannotBeMade) {
  fs::create_directories(folder_ / "set.dtr");
  WriteFileAtomically(In("set.dtr/mine"), "precious");
  const std::vector<std::string> poses = {"--poses", Shared("courtyard/sparse")};
  ExpectRejected(Build(Photos(), poses), kWrongUsage, "expected no such folder yet, found one");
  ExpectRejected(Build(Photos(), {"--force", "--poses", Shared("courtyard/sparse")}), kWrongUsage,
                 "expected a D+TR set to replace, found something else");
  EXPECT_EQ(Text(In("set.dtr/mine")), "precious");
  const Ran onto_file = Dtr({"build", Photos(), "-o", In("set.dtr/mine"), "--force"});
  ExpectRejected(onto_file, kWrongUsage, "expected no such folder yet, found a file");
  EXPECT_THAT(onto_file.err, Not(HasSubstr("== photos")));  // said before any is read
  ExpectRejected(Dtr({"evaluate", Shared("good.dtr"), "--images", In("set.dtr/mine")}), kWrongUsage,
                 ": expected a folder, found a file");
  const auto build_into = [&](const std::string& set) {
    return Dtr({"build", Photos(), "-o", set, "--poses", Shared("courtyard/sparse")});
  };
  ExpectRejected(build_into(In("set.dtr/mine/set.dtr")), kFailed,
                 "cannot be made: Not a directory");
  ExpectRejected(build_into("/proc/set.dtr"), kFailed, "cannot be made: No such file or directory");
  ExpectRejected(Dtr({"export", Shared("good.dtr"), "--format", "colmap", "-o", In("set.dtr")}),
                 kWrongUsage, "exists already; choose another name");
  ExpectRejected(Dtr({"export", Shared("good.dtr"), "-o", In("absent/colmap")}), kWrongUsage,
                 "expected an existing folder to write into, found nothing");
  ExpectRejected(Dtr({"info", Shared("good.dtr"), "--json", In("absent/info.json")}), kWrongUsage,
                 "expected an existing folder to write into, found nothing");
}

TEST_F(BadInput, HoldoutsAndPosesThatDoNotFit) {
  const auto with = [&](const std::string& option, const std::string& value) {
    return Build(Photos(), option == "--poses"
                               ? std::vector<std::string>{option, value}
                               : std::vector<std::string>{"--poses", Shared("courtyard/sparse"),
                                                          option, value});
  };
  ExpectRejected(with("--holdout", "0000,0001,0002,0003,0004,0005"), kWrongUsage,
                 "expected at least 2 photos to build from, found 1 of 7");
  ExpectRejected(with("--holdout", "every:1"), kWrongUsage,
                 "expected every:N with a whole number N >= 2, found '1'");
  ExpectRejected(with("--holdout", "nobody"), kWrongUsage, "no photo is named 'nobody'");
  ExpectRejected(with("--poses", In("absent")), kWrongUsage, "no such file or folder");
  fs::create_directories(folder_ / "empty");
  EXPECT_EQ(with("--poses", In("empty")).code, kFailed);
  ExpectNothingBuilt();
}

TEST_F(BadInput, WordsThatMeanNothing) {
  ExpectRejected(Dtr({"info", Shared("good.dtr"), "--frobnicate"}), kWrongUsage,
                 "The following argument was not expected: --frobnicate");
  ExpectRejected(Dtr({"frobnicate"}), kWrongUsage, "no command is called 'frobnicate'");
  ExpectRejected(Dtr({}), kWrongUsage, "A subcommand is required");
  ExpectRejected(Dtr({"build"}), kWrongUsage, "PHOTOS is required");
  ExpectRejected(Build(Photos(), {"--engine", "magic"}), kWrongUsage, "--engine: magic not in");
  ExpectRejected(Build(Photos(), {"--threads", "-1"}), kWrongUsage,
                 "--threads: Value -1 not in range");
  ExpectRejected(Dtr({"info", Shared("good.dtr"), "--threads", "1.5"}), kWrongUsage,
                 "--threads: expected a whole number, found 1.5");
  ExpectRejected(Dtr({"join", Shared("good.dtr"), Shared("good.dtr"), "-o", In("j"), "--fps", "0"}),
                 kWrongUsage, "--fps: expected a number above 0, found 0");
}

TEST_F(BadInput, SetsCutShort) {
  const std::string text = Text(Shared("good.dtr/set.json"));
  const fs::path set = Copy();
  constexpr size_t kCuts = 12;  // tests/io cuts in-process, 13 bytes at a time
  WriteFileAtomically(set / "set.json", "");
  ExpectRejected(Dtr({"info", set.string()}), kFailed,
                 "expected JSON, found an empty file; copy it again");
  for (size_t i = 1; i < kCuts; ++i) {
    WriteFileAtomically(set / "set.json", text.substr(0, i * (text.size() - 1) / kCuts));
    ExpectRejected(Dtr({"info", set.string()}), kFailed,
                   "expected JSON, found an error after byte");
  }
  ExpectRejected(Dtr({"info", In("absent.dtr")}), kFailed,
                 "expected the folder of a D+TR set, found nothing");
  fs::remove(set / "set.json");
  ExpectRejected(Dtr({"info", set.string()}), kFailed,
                 "expected the file that makes a folder a D+TR set");
}

TEST_F(BadInput, SetsWithWrongFields) {
  ExpectRejected(InfoAfter("\"format_version\": 1", "\"format_version\": 7"), kFailed,
                 "format_version: expected 1 or 2, found 7");
  ExpectRejected(InfoAfter("\"translation\": [", "\"translation\": [NaN, "), kFailed,
                 "expected JSON, found an error after byte");
  ExpectRejected(InfoAfter("\"translation\": [", "\"translation\": [null, "), kFailed,
                 "cam_from_world.translation: expected 3 numbers");
  ExpectRejected(InfoAfter("\"translation\": [", "\"translation\": [1e300, 0, 0], \"old\": ["),
                 kFailed, "cam_from_world.translation: expected 3 numbers within 1e+18 of 0");
  ExpectRejected(InfoAfter("\"fx_px\": ", "\"fx_px\": -"), kFailed,
                 "camera.fx_px: expected a positive number");
  ExpectRejected(InfoAfter("\"images/0001.png\"", "\"../0001.png\""), kFailed,
                 "image.path: expected a relative path inside the set's folder");
}

TEST_F(BadInput, SetsOfAnotherToolStayReadable) {
  EXPECT_EQ(InfoAfter("\"verdict\": {}", "\"verdict\": {\"passed\": false, \"tests\": [1]}").code,
            0);
  EXPECT_EQ(InfoAfter("\"verdict\": {}", "\"verdict\": {\"passed\": false, \"tests\": 1}").code, 0);
  InfoAfter("\"provenance\": {", "\"provenance\": {\"held_out_not_registered\": [1],");
  EXPECT_EQ(Dtr({"evaluate", In("bad.dtr"), "--renderer", "cpu"}).code, 0);
}

TEST_F(BadInput, SetsWithMissingOrDamagedFiles) {
  fs::path set = Copy();
  fs::remove(set / "depth/0001.png");
  ExpectRejected(Dtr({"info", set.string()}), kFailed,
                 "depth.path: expected a file, found nothing");
  set = Copy();
  fs::resize_file(set / "images/0001.png", 100);
  ExpectRejected(Dtr({"info", set.string()}), kFailed, "bytes as recorded, found 100");
  for (const char* file : {"images/0001.png", "held_out/images/0004.png"}) {
    set = Copy();
    std::string bytes = Text(set / file);
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
    WriteFileAtomically(set / file, bytes);
    const Ran ran = Dtr({"info", set.string(), "--verify"});
    EXPECT_EQ(ran.code, kFailed);
    EXPECT_THAT(ran.out, HasSubstr("image.sha256: expected "));
    EXPECT_THAT(ran.out, HasSubstr(file));
  }
  set = Copy();
  // Another view's size in a file of the recorded length: only reading it can tell.
  const auto length = fs::file_size(set / "depth/0001.png");
  io::WriteImage(set / "depth/0001.png", ImageRgb8(7, 5, 3));
  fs::resize_file(set / "depth/0001.png", length);
  const Ran ran = Dtr({"evaluate", set.string(), "--renderer", "cpu"});
  EXPECT_EQ(ran.code, kFailed);
  EXPECT_EQ(ran.ErrorLines().size(), 1u) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("depth/0001.png: expected "));
}

TEST_F(BadInput, AViewThatCannotBeReadIsLeftOutOfAPictureAndNamed) {
  const fs::path set = Copy();
  for (const char* file : {"depth/0001.png", "depth/0002.png"}) {
    // The recorded length, another content: only reading it can tell.
    WriteFileAtomically(set / file, std::string(fs::file_size(set / file), '?'));
  }
  const Ran ran = Dtr({"render", set.string(), "--renderer", "cpu", "--like", "0001", "-o",
                       In("view.png"), "--json", In("render.json")});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("WARNING: 0001.jpg is left out: "));
  EXPECT_THAT(ran.err, HasSubstr("depth/0001.png: "));
  const Json json = Json::parse(Text(In("render.json")));
  ASSERT_EQ(json["skipped"].size(), 2u);
  for (const Json& skipped : json["skipped"]) {
    EXPECT_NE(skipped["name"], "");
    EXPECT_THAT(skipped["reason"].get<std::string>(), HasSubstr("depth/000"));
  }
  for (const Json& name : json["frames"][0]["views_used"]) {
    EXPECT_NE(name, "0001.jpg");
    EXPECT_NE(name, "0002.jpg");
  }
  EXPECT_GT(json["frames"][0]["coverage"], 0.2);
}

TEST_F(BadInput, PicturesThatCannotBeAskedForOrWritten) {
  ExpectRejected(Render({"--like", "nobody", "-o", In("view.png")}), kWrongUsage,
                 "no view is named 'nobody'");
  ExpectRejected(Render({"-o", In("view.png")}), kWrongUsage, "Exactly 1 option from");
  ExpectRejected(Render({"--like", "0001", "-o", In("view.xyz")}), kWrongUsage,
                 "expected a name ending in .png or .jpg or .jpeg, found '.xyz'");
  ExpectRejected(Render({"--like", "0001", "-o", In("absent/view.png")}), kWrongUsage,
                 "expected an existing folder to write into, found nothing");
  ExpectRejected(Render({"--fly-through", "3", "-o", In("path.png")}), kWrongUsage,
                 "several frames need a folder or an .mp4 file");
  ExpectRejected(Render({"--like", "0001", "-o", In("view.png"), "--size", "0x0"}), kWrongUsage,
                 "expected at least one side above 0");
  ExpectRejected(Render({"--like", "0001", "-o", In("view.png"), "--depth-out", In("d.png")}),
                 kWrongUsage, "expected a name ending in .exr, found '.png'");
  ExpectRejected(Render({"--camera", In("absent.json"), "-o", In("view.png")}), kWrongUsage,
                 "no such file or folder");
  EXPECT_THAT(Contents(folder_.path()), IsEmpty());
}

TEST_F(BadInput, ACameraThatNoViewServesGivesAnEmptyPictureAndAWarning) {
  const Ran ran = Render({"--like", "0001", "--exclude", "0001", "--max-angle", "0.001", "-o",
                          In("view.png"), "--json", In("render.json")});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("WARNING: 0001: no view is valid for this camera"));
  const Json frame = Json::parse(Text(In("render.json")))["frames"][0];
  EXPECT_EQ(frame["views_used"].size(), 0u);
  EXPECT_EQ(frame["coverage"], 0);
  const ImageRgb8 picture = io::ReadImage(In("view.png"));
  for (const auto value : picture.data()) ASSERT_EQ(value, 0);
}

}  // namespace
}  // namespace dtr::testing
