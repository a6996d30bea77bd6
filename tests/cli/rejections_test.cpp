// Requests that need no set-up of their own to be rejected: each in one line, with the right exit
// code.
#include "dtr/io/image_io.h"
#include "tests/capture/photo_files.h"
#include "tests/cli/refusals.h"
#include "tests/support/environment.h"

namespace dtr::testing {
namespace {

TEST_F(Rejections, WhatIsNoDataSet) {
  const std::string taken = Folder("taken"), file = Write("file", "");
  const auto make = [&](const std::string& scene, std::vector<std::string> further) {
    further.insert(further.begin(), {"dataset", "make", scene, "-o", In("made")});
    return further;
  };
  ExpectAllRejected({
      {kWrongUsage,
       "scene: expected courtyard, plane, stairs, sphere, room, plain-room or toys, found 'park'",
       make("park", {})},
      {kWrongUsage, "for scene 'plane', found 'circle'", make("plane", {"--layout", "circle"})},
      {kWrongUsage, "views: expected 2 to", make("plane", {"--views", "1"})},
      {kWrongUsage, "fold the image over before its corners; take smaller ones",
       make("plane", {"--k1", "-5"})},
      {kWrongUsage, "lens distortion: expected finite k1, k2", make("plane", {"--k1", "nan"})},
      {kWrongUsage,
       "expected a folder that does not exist yet; remove it or choose another name",
       {"dataset", "make", "plane", "-o", taken}},
      {kFailed,
       "cannot be written: Not a directory",
       {"dataset", "make", "plane", "-o", file + "/made"}},
      {kWrongUsage,
       "is not downloaded but made; use `dtr dataset make plane`",
       {"dataset", "get", "plane", "--folder", taken}},
      {kWrongUsage,
       "data set: expected a public set's name, found 'nobody'",
       {"dataset", "get", "nobody", "--folder", taken}},
      {kFailed,
       "expected a folder with the set llff_fern, found none; it comes from",
       {"dataset", "get", "llff_fern", "--folder", In("absent")}},
      {kWrongUsage, "KIND: magic not in", {"dataset", "convert", "magic", taken, "-o", In("made")}},
      {kWrongUsage,
       "exists; choose another folder or remove it",
       {"dataset", "convert", "fountain", taken, "-o", taken}},
      {kFailed,
       "expected the folder of the set, found none",
       {"dataset", "convert", "fountain", In("absent"), "-o", In("made")}},
      {kFailed,
       "found none; give the folder that holds the set's SOURCE.md",
       {"dataset", "convert", "fountain", taken, "-o", In("made")}},
  });
  EXPECT_FALSE(fs::exists(In("made")));
}

TEST_F(Rejections, ASetOfOneViewServesNothingThatComparesViews) {
  const std::string one = Shared("one.dtr");
  ExpectAllRejected({
      {kWrongUsage,
       "evaluate: expected a held-out view in the set, found none; build it with",
       {"evaluate", one, "--renderer", "cpu"}},
      {kWrongUsage,
       "--leave-one-out: expected at least 2 source views in the set, found 1",
       {"evaluate", one, "--renderer", "cpu", "--leave-one-out"}},
      {kWrongUsage,
       "bench: expected a held-out view, or two source views to leave one out of, found 1",
       {"bench", one, "--renderer", "cpu", "--table", "report"}},
      {kFailed,
       "expected at least 2 source views with depth, found 1; run dtr stereo first",
       {"advise", one, "-o", In("advice.html")}},
      {kFailed,
       "pruning: expected at least 2 source views to look between, found 1",
       {"prune", one, "--renderer", "cpu", "-o", In("pruned.dtr")}},
      {kWrongUsage,
       "join: expected two sets or more, in order of time",
       {"join", one, "-o", In("moving.dtr")}},
      {kFailed,
       ": unit: expected metre as in",
       {"join", Shared("good.dtr"), one, "-o", In("moving.dtr")}},
  });
  EXPECT_FALSE(fs::exists(In("moving.dtr")));
}

TEST_F(Rejections, TruthThatIsNotTheSets) {
  Json others = Cameras(), longer = Cameras(), few = Cameras();
  for (size_t i = 0; i < others["views"].size(); ++i) {
    others["views"][i]["name"] = fmt::format("other{}.jpg", i);
    longer["views"][i]["fx"] = 2 * longer["views"][i]["fx"].get<double>();
  }
  few["views"].erase(few["views"].begin() + 2, few["views"].end());
  few["views"][0]["cam_from_world"][0][3] = 9;
  Write("few/cameras.json", few.dump());
  Write("others/cameras.json", others.dump());
  Write("longer/cameras.json", longer.dump());
  fs::copy(Shared("courtyard/depth"), In("longer/depth"));
  const auto evaluate = [&](const std::string& truth) {
    return std::vector<std::string>{"evaluate", Shared("good.dtr"), "--renderer",
                                    "cpu",      "--depth",          In(truth)};
  };
  ExpectAllRejected({
      {kFailed, "expected true cameras of the set's views by name, found none of 7",
       evaluate("others")},
      {kFailed, "cast the truth again on the set's cameras", evaluate("longer")},
      {kFailed, "alignment: expected two sets of at least 3 points each, found 2 and 2",
       evaluate("few")},
      {kFailed, ": cannot be read: No such file or directory", evaluate("absent")},
  });
}

TEST_F(Rejections, ASetWithoutPointsServesNothingThatNeedsThem) {
  const std::string set = Shared("good.dtr");
  ExpectAllRejected({
      {kFailed,
       "sparse: expected the points behind the calibration, found nothing; build the set",
       {"validate", set}},
      {kFailed,
       "expected sparse points to find depth ranges from, found none; build the set",
       {"stereo", set, "-o", In("other.dtr")}},
      {kWrongUsage,
       "--images: is for cameras and calibrations, not for sets",
       {"validate", set, "--images", Photos()}},
  });
}

TEST_F(Rejections, PicturesOfNoSizeOrOfSeveralCameras) {
  const auto render = [&](std::vector<std::string> further) {
    further.insert(further.begin(), {"render", Shared("good.dtr"), "--renderer", "cpu"});
    return further;
  };
  Json huge = Cameras();
  huge["views"].erase(huge["views"].begin() + 1, huge["views"].end());
  huge["views"][0]["width"] = huge["views"][0]["height"] = 20000;
  huge["views"][0]["fx"] = huge["views"][0]["fy"] = 20000;
  const std::string picture = In("view.png"), folder = Folder("folder.png");
  ExpectAllRejected({
      {kWrongUsage, "--size 10: expected WxH, such as 1280x720",
       render({"--like", "0001", "-o", picture, "--size", "10"})},
      {kWrongUsage, "expected WxH in pixels, each 0 to 16384, found '99999'",
       render({"--like", "0001", "-o", picture, "--size", "99999x10"})},
      {kWrongUsage, "image: expected at most 2^28 pixels, found 20000x20000",
       render({"--camera", Write("huge.json", huge.dump()), "-o", picture})},
      {kWrongUsage, "expected one camera, found 7; give --path for several",
       render({"--camera", Shared("courtyard/cameras.json"), "-o", picture})},
      {kWrongUsage, "--depth-out, --coverage-out: expected one camera with them, found several",
       render({"--fly-through", "3", "-o", In("frames"), "--depth-out", In("d.exr")})},
      {kWrongUsage, ": expected a file name, found a folder",
       render({"--like", "0001", "-o", folder})},
      {kWrongUsage,
       ": expected a file name, found a folder",
       {"info", Shared("good.dtr"), "--json", folder}},
  });
  EXPECT_FALSE(fs::exists(picture));
  EXPECT_FALSE(fs::exists(In("frames")));
}

TEST_F(Rejections, VideosWithoutFfmpegOrWithOneThatFails) {
  const Environment path("PATH", In("bin"));
  const std::vector<std::string> fly = {
      "render", Shared("good.dtr"), "--renderer", "cpu", "--fly-through",
      "2",      "--size",           "24x16",      "-o",  In("path.mp4")};
  ExpectRejected(Dtr(fly), kFailed,
                 "program ffmpeg not found on the PATH; install it or write images to a folder");
  Program("ffmpeg", "echo no such encoder; exit 3");
  ExpectRejected(Dtr(fly), kFailed, "ffmpeg failed with exit code 3: no such encoder");
  const fs::directory_iterator left(folder_.path());
  EXPECT_EQ(std::distance(begin(left), end(left)), 1) << "more than bin/ is left";
}

// A lens is calibrated on photos as they are stored; of an upright one it would be a mirrored one.
TEST_F(Rejections, APhotoThatIsTurnedIsNotOfAKnownLens) {
  const std::string photos = Folder("turned");
  fs::copy(Photos(), photos, fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  capture::testing::AddExifOrientation(In("turned/0001.jpg"), 3);
  Write("one/cameras.txt", "1 PINHOLE 192 128 150 150 96 64\n");
  ExpectAllRejected(
      {{kFailed,
        "0001.jpg: expected a photo as it is stored, which the intrinsics are of, found one that "
        "its EXIF orientation rotated",
        {"calibrate", "photos", photos, "-o", In("new"), "--lens", In("one/cameras.txt")}}});
  // Cameras of a model that says nothing else are of the pixels as stored.
  const Ran built = DtrOk({"build", photos, "-o", In("set.dtr"), "--poses",
                           Shared("courtyard/sparse"), "--engine", "none"});
  EXPECT_THAT(built.err,
              ::testing::HasSubstr("1 photos with an EXIF orientation, first 0001.jpg: taken as "
                                   "they are stored"));
}

TEST_F(Rejections, CalibrationsOfTakenFoldersAndOfOtherLenses) {
  const std::string taken = Folder("taken");
  Write("taken/cameras.bin", "");
  Write("two/cameras.txt", "1 PINHOLE 192 128 150 150 96 64\n2 PINHOLE 192 128 150 150 96 64\n");
  ExpectAllRejected({
      {kWrongUsage,
       "expected no model yet, found one; remove it or choose another folder",
       {"calibrate", "photos", Photos(), "-o", taken}},
      {kWrongUsage,
       "expected no model yet, found one; remove it or choose another folder",
       {"calibrate", "refine", Shared("courtyard/sparse"), "-o", taken}},
      {kFailed,
       "expected one camera, found 2; give a file with the camera that took the photos",
       {"calibrate", "photos", Photos(), "-o", In("new"), "--lens", In("two/cameras.txt")}},
      {kWrongUsage,
       "expected a pixel of every view joined with +, found none of 0002",
       {"calibrate", "scale", Shared("good.dtr"), "-o", In("metres.dtr"), "--distance",
        "0001:5:5+0002,0003=5m"}},
      {kFailed,
       "click the same point in views from different positions",
       {"calibrate", "scale", Shared("good.dtr"), "-o", In("metres.dtr"), "--distance",
        "0001:5:64+0005:187:64,0003=5m"}},
  });
}

TEST_F(Rejections, BoardsAndRigsThatCannotBe) {
  const auto board = [&](const std::string& words) {
    return std::vector<std::string>{"calibrate",  "board",   Photos(), "-o",
                                    In("c.json"), "--board", words};
  };
  const auto rig = [&](const std::string& folder, std::vector<std::string> further = {}) {
    further.insert(further.begin(), {"calibrate", "rig", folder, "-o", In("rig.json"), "--board",
                                     "chessboard:9x6:25mm"});
    return further;
  };
  const std::string names = Folder("names"), table = Folder("table"), number = Folder("number"),
                    empty = Folder("empty");
  for (const std::string& folder : {names, table, number, empty}) {
    WriteFileAtomically(folder + "/left.avi", "x");
    WriteFileAtomically(folder + "/right.avi", "x");
  }
  Write("table/timestamps.csv", "time,camera\n1,2\n");
  Write("empty/timestamps.csv", "");
  Write("names/timestamps.csv", "sync_index,cam_id,frame_index\n0,0,0\n");
  Write("number/timestamps.csv", "sync_index,cam_id,frame_index\n0,first,0\n");
  ExpectAllRejected({
      {kWrongUsage, "inner corners per side, found 2 x 9", board("chessboard:2x9:25mm")},
      {kWrongUsage, "no length in '-1'; expected chessboard:WxH:SQUARE",
       board("chessboard:9x6:-1")},
      {kWrongUsage, "expected markers smaller than their squares, found a share of 1.2",
       board("charuco:9x6:25mm:30mm")},
      {kWrongUsage, "expected a dictionary of OpenCV, as DICT_4X4_50, found 'DICT_9'",
       board("charuco:9x6:25mm:10mm:DICT_9")},
      {kWrongUsage, "--camera left: expected NAME=FILE", rig(names, {"--camera", "left"})},
      {kFailed, "timestamps.csv: expected a column sync_index, found time, camera", rig(table)},
      {kFailed, "timestamps.csv: expected a column sync_index, found none", rig(empty)},
      {kFailed, "timestamps.csv: line 2: cam_id: expected a whole number", rig(number)},
      {kFailed, "expected a number at the end of the name, the cam_id of timestamps.csv",
       rig(names)},
  });
  EXPECT_FALSE(fs::exists(In("rig.json")));
}

TEST_F(Rejections, PosesThatAreNotOfThesePhotos) {
  int sets = 0;  // what one begins is not in the way of the next
  const auto build = [&](std::vector<std::string> further) {
    further.insert(further.begin(), {"build", Photos(), "-o", In(fmt::format("{}.dtr", sets++))});
    return further;
  };
  const std::string pinhole = "PINHOLE 100 100 150 150 50 50";
  ExpectAllRejected({
      {kWrongUsage, "--holdout-strict: keeps the photos of --holdout out of SfM; it needs",
       build({"--holdout-strict"})},
      {kWrongUsage,
       "not recognised; what can be read (its --format): the folder of a COLMAP model (colmap)",
       build({"--poses", Write("poses.txt", "")})},
      {kFailed,
       "expected cameras for at least 2 of the photos by name, found 0; its first is 'a.jpg'",
       build({"--poses", Model("names", pinhole, "a.jpg", "b.jpg")})},
      {kFailed, "calibration: expected at least 2 photos to build from, found 1 with a camera",
       build({"--holdout", "0000", "--poses",
              Model("two", "PINHOLE 192 128 150 150 96 64", "0000.jpg", "0001.jpg")})},
      {kFailed, "expected a photo of 100x100 pixels as its camera has, found 192x128",
       build({"--poses", Model("sizes", pinhole, "0000.jpg", "0001.jpg")})},
  });
  for (int i = 0; i < sets; ++i) EXPECT_FALSE(fs::exists(In(fmt::format("{}.dtr", i))));
  Write("set.dtr.partial", "mine");
  ExpectRejected(
      Dtr({"build", Photos(), "-o", In("set.dtr"), "--poses", Shared("courtyard/sparse")}),
      kWrongUsage, "expected a folder or nothing, found a file; move it away");
  EXPECT_EQ(Text(In("set.dtr.partial")), "mine");
}

TEST_F(Rejections, AProgramCalledColmapThatIsNotIt) {
  const Environment path("PATH", In("bin"));
  const auto build = [&] {
    return Dtr({"build", Photos(), "-o", In("set.dtr"), "--sfm", "colmap"});
  };
  Program("colmap", "exit 3");
  ExpectRejected(build(), kFailed, "'colmap help' failed (exit code 3); reinstall COLMAP");
  Program("colmap", "echo Hello");
  ExpectRejected(build(), kFailed,
                 "expected a program that calls itself COLMAP, found one that does not");
  Program("colmap", "echo COLMAP 9.9");
  ExpectRejected(build(), kFailed,
                 "without it; install another version (tested with 3.8 and 3.10)");
  ExpectRejected(Dtr({"build", Photos(), "-o", In("other.dtr"), "--memory", "0.001"}), kWrongUsage,
                 "--memory 0.001: expected at least");
  EXPECT_FALSE(fs::exists(In("set.dtr")));
  EXPECT_FALSE(fs::exists(In("other.dtr")));
}

TEST_F(Rejections, DepthThatCannotBeHad) {
  const std::string set = In("set.dtr");
  DtrOk({"build", Photos(), "-o", set, "--poses", Shared("courtyard/sparse"), "--engine", "none",
         "--max-size", "96"});
  Model("lens/sparse", "SIMPLE_RADIAL 96 64 75 48 32 0.1", "0000.jpg", "0001.jpg");
  Model("other/sparse", "PINHOLE 96 64 75 75 48 32", "a.jpg", "b.jpg");
  ExpectAllRejected({
      {kFailed,
       "camera 1: expected an undistorted camera, found SIMPLE_RADIAL",
       {"stereo", set, "-o", In("a.dtr"), "--engine", "colmap", "--workspace", In("lens")}},
      {kFailed,
       "expected an image of this name, found none; make the workspace from this set",
       {"stereo", set, "-o", In("b.dtr"), "--engine", "colmap", "--workspace", In("other")}},
      {kFailed,
       "expected a bound that 16 bits can keep over its depths of",
       {"stereo", set, "-o", In("c.dtr"), "--engine", "sgbm", "--depth-error", "1e-6"}},
  });
  for (const char* name : {"a.dtr", "b.dtr", "c.dtr"}) EXPECT_FALSE(fs::exists(In(name)));
}

TEST_F(Rejections, OptionsOfVideosForPhotosAndOfPhotosForVideos) {
  const std::string video = Write("walk.mp4", "");
  const std::string found = "for --every, --motion, --max-frames and --synchronised, found neither";
  ExpectAllRejected({
      {kWrongUsage, found, {"capture", Photos(), "-o", In("c"), "--every", "2"}},
      {kWrongUsage, found, {"build", Photos(), "-o", In("s.dtr"), "--max-frames", "5"}},
      {kWrongUsage, found, {"build", Photos(), "-o", In("s.dtr"), "--synchronised"}},
      {kWrongUsage,
       "--gps: expected photos, which say where they were taken, found a video",
       {"build", video, "-o", In("s.dtr"), "--gps"}},
  });
}

TEST_F(Rejections, PhotosThatAreAllDropped) {
  Folder("dark");
  for (const char* name : {"dark/a.png", "dark/b.png"}) {
    io::WriteImage(In(name), ImageRgb8(64, 48, 3));
  }
  ExpectRejected(Dtr({"capture", In("dark"), "-o", In("capture"), "--drop", "underexposed"}),
                 kFailed,
                 "expected photos without the faults of --drop, found none; leave out --drop");
  EXPECT_FALSE(fs::exists(In("capture")));
}

TEST_F(Rejections, FilesAndFoldersOfAnotherKind) {
  const std::string file = Write("file", "");
  ExpectAllRejected({
      {kFailed,
       "give the file in it that has the cameras",
       {"render", Shared("good.dtr"), "--renderer", "cpu", "--camera", Folder("folder"), "-o",
        In("view.png")}},
      {kFailed,
       "expected a folder or file that can be used, found: Not a directory; fix it or choose "
       "another",
       {"evaluate", Shared("good.dtr"), "--renderer", "cpu", "--images", file + "/pictures"}},
  });
}

TEST_F(Rejections, AFileThatEndsBeforeItsSize) {
  // The kernel says 4096 bytes of it, and gives some dozens.
  const fs::path shorter = "/sys/kernel/mm/transparent_hugepage/enabled";
  if (!fs::exists(shorter)) GTEST_SKIP() << "no " << shorter;
  ExpectRejected(Dtr({"import", "--cameras", shorter.string(), "--format", "cameras-json",
                      "--images", Folder("photos"), "-o", In("cut.dtr")}),
                 kFailed,
                 "that can be read; read it again once nothing writes it, or copy it again");
}

TEST_F(Rejections, AFolderForTemporaryFilesThatTakesNone) {
  ExpectRejected(Shell(fmt::format("TMPDIR=/proc exec {} bench {} --renderer cpu --stage render "
                                   "--point default",
                                   DTR_PROGRAM, Shared("good.dtr"))),
                 kFailed, "choose another folder, or set TMPDIR to a folder that can be written");
}

TEST_F(Rejections, TooLittleMemoryIsSaidInOneLine) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer takes addresses without end";
#endif
  // Room to start in, and less than the image: 8192 x 8192 pixels.
  const Ran ran = Shell(
      fmt::format("ulimit -v 900000; exec {} render {} --renderer cpu --threads 1 --like 0001 "
                  "--size 8192x8192 --memory 100 -o {}",
                  DTR_PROGRAM, Shared("good.dtr"), In("view.png")));
  ExpectRejected(ran, kFailed, "memory: expected enough for this job, found too little");
  EXPECT_FALSE(fs::exists(In("view.png")));
}

}  // namespace
}  // namespace dtr::testing
