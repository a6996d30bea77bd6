#include "calib/colmap/sfm.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <mutex>

#include "calib/colmap/features.h"
#include "calib/colmap/held_out.h"
#include "calib/colmap/matching.h"
#include "calib/colmap/model_io.h"
#include "calib/colmap/workspace.h"
#include "dtr/base/error.h"
#include "dtr/io/image_io.h"
#include "tests/calib/colmap/fake_colmap.h"
#include "tests/calib/colmap/model_test_support.h"

namespace dtr::colmap {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Pair;

constexpr std::uintmax_t kFileLimit = 1 << 20;

// Notes what it is told, and can ask to stop once a stage has begun.
class Listener final : public Progress {
 public:
  void Stage(const std::string& name, int total) override {
    stages.push_back(name + "/" + std::to_string(total));
    if (name == stop_at) stop = true;
  }
  void Update(int done) override { updates.push_back(done); }
  void Note(const std::string& line) override { notes.push_back(line); }
  bool StopRequested() const override { return stop; }

  std::vector<std::string> stages, notes;
  std::vector<int> updates;
  std::string stop_at;
  std::atomic<bool> stop = false;
};

// Photos that only a fake COLMAP will ever open, named so that lists of names would break.
class RunSfmWithFake : public ::testing::Test {
 protected:
  RunSfmWithFake() {
    fs::create_directories(photos_ / "Über uns");
    for (const char* name : {"Über uns/b photo.JPG", "a b.jpg", "c.jpg", "d.png"}) {
      WriteFileAtomically(photos_ / name, std::string("photo ") + name);
      images_.push_back({name, 640, 480, 500.0, "camera one"});
    }
    options_.threads = 2;
    fake_.LeaveDatabase(Aliases());
    LeaveModel(0, 2);
    LeaveModel(1, 3);
  }

  // A model of the first `count` photos in order of names, under the names COLMAP sees.
  void LeaveModel(int number, size_t count) {
    calib::SfmModel model;
    model.cameras[1] = {calib::LensModel::kSimpleRadial, 640, 480, {500, 320, 240, 0}};
    for (size_t i = 0; i < count; ++i) {
      calib::SfmImage image;
      image.id = static_cast<std::uint32_t>(i + 1);
      image.name = Workspace::AliasFor("", i, sorted_[i]);
      image.camera_id = 1;
      image.features.push_back({{320 + static_cast<double>(i), 240}, 9});
      model.images.push_back(image);
    }
    model.points[9] = {{0, 0, 5}, {1, 2, 3}, 0.5};
    const fs::path folder = fake_ / ("model." + std::to_string(number));
    fs::remove_all(folder);
    WriteModel(folder, model, Format::kBinary);
  }

  // Photos after those that every test has, by name too.
  void LeaveMorePhotos(int count) {
    for (int i = 0; i < count; ++i) {
      const std::string name = fmt::format("Über uns/c {:03}.jpg", i);
      WriteFileAtomically(photos_ / name, "photo " + name);
      images_.push_back({name, 640, 480, 500.0, "camera one"});
      sorted_.push_back(name);
    }
  }

  std::vector<std::string> Aliases() const {
    std::vector<std::string> aliases;
    for (size_t i = 0; i < sorted_.size(); ++i) {
      aliases.push_back(Workspace::AliasFor("", i, sorted_[i]));
    }
    return aliases;
  }

  SfmResult Run() {
    return RunSfm(photos_.path(), images_, workspace_ / "sfm", options_, listener_);
  }

  std::string MessageOfRun() {
    try {
      Run();
    } catch (const Error& error) {
      return error.what();
    }
    return "(no error)";
  }

  std::vector<std::string> sorted_ = {"a b.jpg", "c.jpg", "d.png", "Über uns/b photo.JPG"};
  const dtr::testing::TemporaryFolder photos_, workspace_;
  testing::FakeColmap fake_;
  std::vector<SfmImageInput> images_;
  SfmOptions options_;
  Listener listener_;
};

TEST_F(RunSfmWithFake, TakesTheLargestModelAndNamesWhoIsMissing) {
  const SfmResult result = Run();
  ASSERT_EQ(result.model.images.size(), 3u);
  EXPECT_EQ(result.model.images[0].name, "a b.jpg");
  EXPECT_EQ(result.model.images[2].name, "d.png");
  EXPECT_THAT(result.report.not_registered, ElementsAre("Über uns/b photo.JPG"));
  EXPECT_THAT(result.report.images_per_model, ElementsAre(3, 2));
  // The point projects to (320, 240) in all; the features lie 0, 1 and 2 px beside.
  EXPECT_DOUBLE_EQ(result.report.mean_reprojection_error_px, 1.0);
  EXPECT_EQ(result.report.version, "COLMAP 3.8 (a fake one)");
  EXPECT_THAT(listener_.stages, ElementsAre("features/4", "matching/100", "mapping/4"));
  EXPECT_THAT(listener_.updates, ElementsAre(1, 2, 3, 4, 50, 100, 2, 3));
}

TEST_F(RunSfmWithFake, SaysWhatPhotosWithoutACameraHaveInCommonWithOthers) {
  LeaveModel(1, 2);  // d.png and "Über uns/b photo.JPG" find no camera
  const auto why = [&](const std::vector<testing::FakeColmap::Common>& pairs) {
    std::filesystem::remove_all(workspace_ / "sfm");
    fake_.LeaveDatabase(Aliases(), {}, pairs);
    return Run().report.why_not_registered;
  };
  EXPECT_THAT(why({{0, 1, 90}, {0, 2, 20}, {1, 2, 20}, {2, 3, 40}}),
              ElementsAre(Pair("d.png",
                               "20 of its 100 features in common with a b.jpg, with no "
                               "photo more; COLMAP places a photo by 30 that agree"),
                          Pair("Über uns/b photo.JPG",
                               "in common with a photo alone that has no camera either, most with "
                               "d.png (40 features)")));
  EXPECT_THAT(why({{0, 2, 15}, {1, 2, 60}}),
              ElementsAre(Pair("d.png",
                               "60 of its 100 features in common with c.jpg, with no photo "
                               "more; COLMAP found no place that they agree on with those "
                               "of other photos"),
                          Pair("Über uns/b photo.JPG",
                               "100 features, fewer than 15 of them in any other photo")));
  // Three photos that know each other alone.
  images_.push_back({"e.jpg", 640, 480, 500.0, "camera one"});
  WriteFileAtomically(photos_ / "e.jpg", "photo e");
  sorted_.insert(sorted_.begin() + 3, "e.jpg");
  EXPECT_THAT(why({{2, 3, 50}, {2, 4, 60}, {3, 4, 70}})["e.jpg"],
              "in common with 2 photos alone that have no camera either, most with Über uns/b "
              "photo.JPG (70 features)");
  LeaveModel(1, 5);
  EXPECT_THAT(why({}), ElementsAre());
}

TEST_F(RunSfmWithFake, AModelIsNotLostWithTheDatabaseThatSaysWhyPhotosAreNotInIt) {
  Run();
  std::filesystem::remove(workspace_ / "sfm" / "database.db");
  const SfmResult again = Run();
  EXPECT_EQ(again.model.images.size(), 3u);
  EXPECT_THAT(again.report.why_not_registered, ElementsAre());
  EXPECT_THAT(listener_.notes, Contains(HasSubstr("why photos have no camera is not known: ")));
}

TEST_F(RunSfmWithFake, KeepsArgumentsLogAndExitCode) {
  const SfmResult result = Run();
  ASSERT_EQ(result.report.steps.size(), 3u);
  EXPECT_EQ(result.report.steps[2].name, "mapping");
  EXPECT_THAT(result.report.steps[2].argv, Contains("--Mapper.num_threads"));
  EXPECT_THAT(ReadFile(result.report.steps[2].log_file, kFileLimit),
              HasSubstr("Registering image #2"));
  const std::string report = ReadFile(workspace_ / "sfm" / "sfm_run.json", kFileLimit);
  EXPECT_THAT(report, AllOf(HasSubstr("COLMAP 3.8"), HasSubstr("feature_extractor"),
                            HasSubstr("\"exit_code\": 0"), HasSubstr("max_rss_kib")));
}

TEST_F(RunSfmWithFake, SecondRunReturnsTheFrozenModelWithoutRunningCOLMAP) {
  const SfmResult first = Run();
  fake_.ForgetCalls();
  LeaveModel(1, 4);
  options_.threads = 1;  // threads and memory do not change what was asked
  const SfmResult second = Run();
  EXPECT_THAT(fake_.Calls(), ElementsAre());
  testing::ExpectSame(first.model, second.model);
  ASSERT_EQ(second.report.steps.size(), 3u);
  EXPECT_TRUE(second.report.steps[0].from_checkpoint);
}

TEST_F(RunSfmWithFake, ChangedPhotoRunsEverythingAgainChangedSeedToo) {
  Run();
  fake_.ForgetCalls();
  WriteFileAtomically(photos_ / "c.jpg", "photo C.jpg");  // same size
  Run();
  EXPECT_EQ(fake_.Calls().size(), 3u);
  options_.seed = 7;
  Run();
  EXPECT_EQ(fake_.Calls().size(), 6u);
}

TEST_F(RunSfmWithFake, InterruptEndsTheProgramAndTheNextRunGoesOn) {
  fake_.Fail("exhaustive_matcher", "sleep 600");
  listener_.stop_at = "matching";
  EXPECT_THROW(Run(), Interrupted);
  listener_.stop_at.clear();
  listener_.stop = false;
  fake_.Succeed("exhaustive_matcher");
  fake_.ForgetCalls();
  EXPECT_EQ(Run().model.images.size(), 3u);
  ASSERT_EQ(fake_.Calls().size(), 2u);
  EXPECT_THAT(fake_.Calls()[0], HasSubstr("exhaustive_matcher"));
}

// 48 photos are a batch: what an interruption finds done of a later one is thrown away, what it
// finds of those before is kept, and later photos of a camera are of that which the first made.
TEST_F(RunSfmWithFake, FeaturesGoOnAfterTheLastWholeBatch) {
  LeaveMorePhotos(50);
  fake_.LeaveDatabase(Aliases(), std::vector<int>(Aliases().size(), 7));
  fake_.Fail("feature_extractor", "test ! -e \"$database\" || { echo x > \"$database\"; exit 3; }");
  EXPECT_THAT(MessageOfRun(), HasSubstr("found 3"));
  ASSERT_EQ(fake_.Calls().size(), 2u);
  EXPECT_THAT(fake_.Calls()[0], AllOf(HasSubstr("single_camera 1"), Not(HasSubstr("existing"))));
  EXPECT_THAT(fake_.Calls()[1],
              AllOf(HasSubstr("existing_camera_id 7"), Not(HasSubstr("single_camera"))));

  fake_.Fail("feature_extractor", "cmp \"$database\" \"$here/database\" || exit 4");
  fake_.ForgetCalls();
  listener_.updates.clear();
  const SfmResult result = Run();
  ASSERT_EQ(fake_.Calls().size(), 3u);  // the second batch, matching, mapping
  EXPECT_THAT(fake_.Calls()[0], HasSubstr("existing_camera_id 7"));
  EXPECT_EQ(listener_.updates.front(), 48);
  EXPECT_FALSE(fs::exists(workspace_ / "sfm" / "features.db.working"));
  // What the first batch took is not forgotten, and neither is its log.
  ASSERT_EQ(result.report.steps.size(), 4u);
  EXPECT_TRUE(result.report.steps[0].from_checkpoint);
  EXPECT_NE(result.report.steps[0].log_file, result.report.steps[1].log_file);
  EXPECT_TRUE(fs::exists(result.report.steps[0].log_file));
}

// Names are the same to COLMAP whatever the photos: what was found of others must never pass for
// theirs, not even when one comes back to them.
TEST_F(RunSfmWithFake, FeaturesOfOtherPhotosDoNotGoOn) {
  LeaveMorePhotos(50);
  fake_.LeaveDatabase(Aliases());
  const std::string second_fails = "test ! -e \"$database\" || exit 3";
  fake_.Fail("feature_extractor", second_fails);
  EXPECT_THAT(MessageOfRun(), HasSubstr("found 3"));
  const fs::path note = workspace_ / "sfm" / "features.db.begun";
  EXPECT_TRUE(fs::exists(note));
  WriteFileAtomically(photos_ / "c.jpg", "another photo");
  fake_.Fail("feature_extractor", "exit 5");
  EXPECT_THAT(MessageOfRun(), HasSubstr("found 5"));
  EXPECT_FALSE(fs::exists(note)) << "it is of the photos before";
  fake_.Fail("feature_extractor", second_fails);
  EXPECT_THAT(MessageOfRun(), HasSubstr("found 3"));
  WriteFileAtomically(photos_ / "c.jpg", "photo c.jpg");
  fake_.Succeed("feature_extractor");
  fake_.ForgetCalls();
  Run();
  EXPECT_EQ(fake_.Calls().size(), 4u);  // both batches
}

// Killed between the two: a batch more is there than the note says.
TEST_F(RunSfmWithFake, ABatchThatTheNoteDoesNotKnowIsAskedForAgain) {
  LeaveMorePhotos(50);
  fake_.LeaveDatabase(Aliases(), std::vector<int>(Aliases().size(), 7));
  fake_.Fail("feature_extractor", "test ! -e \"$database\" || exit 3");
  EXPECT_THAT(MessageOfRun(), HasSubstr("found 3"));
  const fs::path note = workspace_ / "sfm" / "features.db.begun";
  const std::string first = ReadFile(note, kFileLimit);
  fake_.Succeed("feature_extractor");
  Run();
  fs::remove(workspace_ / "sfm" / "features.done.json");
  WriteFileAtomically(note, first);
  fake_.ForgetCalls();
  Run();
  EXPECT_THAT(fake_.Calls().front(), HasSubstr("existing_camera_id 7"));
  for (size_t length = 0; length < first.size(); length += 7) {
    fs::remove(workspace_ / "sfm" / "features.done.json");
    WriteFileAtomically(note, first.substr(0, length));
    fake_.ForgetCalls();
    Run();
    ASSERT_THAT(fake_.Calls().front(), HasSubstr("single_camera 1")) << length;
  }
}

TEST(InBatches, AreOfWholePhotosInOrderAndGrowWithWhatIsBehindThem) {
  std::vector<CameraGroup> groups(3);
  for (size_t i = 0; i < 400; ++i) groups[i < 300 ? 0 : i < 399 ? 1 : 2].images.push_back(i);
  const auto batches = InBatches(groups);
  size_t next = 0;
  for (const auto& batch : batches) {
    size_t photos = 0;
    const size_t before = next;
    for (const ExtractionRun& run : batch) {
      photos += run.images.size();
      for (const size_t i : run.images) {
        EXPECT_EQ(i, next++);
        EXPECT_EQ(run.group, i < 300 ? 0u : i < 399 ? 1u : 2u);
      }
    }
    EXPECT_EQ(photos, std::min(400 - before, std::max(kPhotosPerBatch, before / 4)));
  }
  EXPECT_EQ(next, 400u);
  EXPECT_EQ(batches.size(), 8u);
  EXPECT_TRUE(InBatches({}).empty());
}

TEST_F(RunSfmWithFake, FailureNamesStepCauseAndLog) {
  fake_.Fail("feature_extractor", "echo fine; echo 'ERROR: the disk is full'; echo bye; exit 1");
  EXPECT_THAT(MessageOfRun(),
              AllOf(HasSubstr("feature_extractor"), HasSubstr("exit code 0, found 1"),
                    HasSubstr("the disk is full"), HasSubstr(".log"), Not(HasSubstr("\n"))));
  EXPECT_THAT(ReadFile(workspace_ / "sfm" / "sfm_run.json", kFileLimit),
              HasSubstr("\"exit_code\": 1"));
}

// COLMAP 3.8 ends with 0 then, and what its database holds is not all there is.
TEST_F(RunSfmWithFake, ADatabaseThatTookNotEverythingIsAFailure) {
  const std::string full = "SQLite error [database.cc, line 989]: database or disk is full";
  fake_.Fail("exhaustive_matcher", "echo '" + full + "'; echo 'Elapsed time: 1'; exit 0");
  EXPECT_THAT(MessageOfRun(), AllOf(HasSubstr("sfm: No space left on device; make room"),
                                    HasSubstr("expected all of its results in its database"),
                                    HasSubstr(full), Not(HasSubstr("\n"))));
  fake_.Succeed("exhaustive_matcher");
  fake_.ForgetCalls();
  EXPECT_EQ(Run().model.images.size(), 3u);
  ASSERT_EQ(fake_.Calls().size(), 2u);  // the features are kept
  EXPECT_THAT(fake_.Calls()[0], HasSubstr("exhaustive_matcher"));
  const std::string locked = "SQLite error [database.cc, line 989]: disk I/O error";
  fake_.Fail("mapper", "echo '" + locked + "'; exit 0");
  fs::remove(workspace_ / "sfm" / "mapping.done.json");
  EXPECT_THAT(MessageOfRun(),
              AllOf(HasSubstr(locked), Not(HasSubstr("No space left")), HasSubstr(".log")));
}

TEST_F(RunSfmWithFake, KilledProgramPointsAtMemory) {
  fake_.Fail("mapper", "kill -9 $$");
  EXPECT_THAT(MessageOfRun(), AllOf(HasSubstr("mapper"), HasSubstr("memory ran out")));
}

TEST_F(RunSfmWithFake, CrashNamesTheSignalAndTheFailedCheck) {
  fake_.Fail("exhaustive_matcher",
             "echo 'F20260101 01:02:03.4 5 a.cc:6] Check failed: x == y'; "
             "echo '    @ 0x1 main'; kill -ABRT $$");
  EXPECT_THAT(MessageOfRun(), AllOf(HasSubstr("signal 6"), HasSubstr("Check failed: x == y")));
}

TEST_F(RunSfmWithFake, PhotosWithNothingInCommonAreToldAsSuch) {
  fs::remove_all(fake_ / "model.0");
  fs::remove_all(fake_ / "model.1");
  EXPECT_THAT(MessageOfRun(), HasSubstr("too little in common"));
  fake_.Fail("mapper",
             "echo '=> No good initial image pair found.'; "
             "echo 'ERROR: failed to create sparse model'; exit 1");
  EXPECT_THAT(MessageOfRun(), HasSubstr("too little in common"));
}

TEST_F(RunSfmWithFake, AWalkStraightAheadStartsFromPhotosInLineWithWhatTheySee) {
  fake_.Fail("mapper",
             "if ! grep -q 'init_max_forward_motion 1' \"$here/calls\"; then "
             "echo '=> No good initial image pair found.'; "
             "echo 'ERROR: failed to create sparse model'; exit 1; fi");
  const SfmResult result = Run();
  EXPECT_EQ(result.model.images.size(), 3u);
  ASSERT_EQ(result.report.steps.size(), 4u);
  EXPECT_THAT(result.report.steps[2].argv, Not(Contains("--Mapper.init_max_forward_motion")));
  EXPECT_THAT(result.report.steps[3].argv, Contains("--Mapper.init_max_forward_motion"));
  EXPECT_TRUE(result.report.forward_motion);
  EXPECT_TRUE(Run().report.forward_motion) << "of a run that goes on from it, too";
}

// Its points are seen under as small angles, and by as few others, as those that made the model.
TEST_F(RunSfmWithFake, HeldOutPhotosOfSuchAWalkAreRegisteredByTheThresholdsThatMadeItsModel) {
  const std::string walk =
      "if ! grep -q 'init_max_forward_motion 1' \"$here/calls\"; then "
      "echo '=> No good initial image pair found.'; exit 1; fi";
  WriteFileAtomically(photos_ / "e.jpg", "photo e.jpg");
  const std::vector<SfmImageInput> held{{"e.jpg", 640, 480, 500.0, "camera one"}};
  std::vector<std::string> aliases = Aliases();
  aliases.push_back("held_000000.jpg");
  fake_.LeaveDatabase(aliases);
  const auto registered = [&](const std::string& folder) {
    const SfmResult result = Run();
    RegisterHeldOut(photos_.path(), held, result.model, images_, workspace_ / "sfm",
                    workspace_ / folder, options_, listener_);
    const std::string call = fake_.Calls().back();
    EXPECT_THAT(call, HasSubstr("image_registrator"));
    return call;
  };
  const std::string fewer = "--Mapper.abs_pose_min_num_inliers 15";
  EXPECT_THAT(registered("held"), Not(HasSubstr(fewer)));
  fake_.Fail("mapper", walk);
  options_.seed = 1;  // another model: the walk's
  EXPECT_THAT(registered("held"), HasSubstr(fewer));
  EXPECT_THAT(registered("again"), HasSubstr(fewer)) << "of a model that was read back";
  fake_.Succeed("mapper");
  options_.seed = 2;
  EXPECT_THAT(registered("held"), Not(HasSubstr(fewer))) << "in the workspace of another model";
}

TEST_F(RunSfmWithFake, GarbageModelIsRefused) {
  WriteFileAtomically(fake_ / "model.0" / "images.bin", "garbage");
  EXPECT_THAT(MessageOfRun(), HasSubstr("images.bin"));
}

TEST_F(RunSfmWithFake, MissingProgramSaysWhatToInstall) {
  const std::string path = std::getenv("PATH");
  setenv("PATH", photos_.path().c_str(), 1);
  const std::string message = MessageOfRun();
  setenv("PATH", path.c_str(), 1);
  EXPECT_THAT(message, AllOf(HasSubstr("not found on the PATH"), HasSubstr("apt-get install")));
}

TEST_F(RunSfmWithFake, MasksLieWhereColmapLooksForThem) {
  Run();
  for (const std::string& call : fake_.Calls()) EXPECT_THAT(call, Not(HasSubstr("mask_path")));
  fake_.ForgetCalls();
  WriteFileAtomically(photos_ / "mask.png", "first");
  images_[1].mask_file = photos_ / "mask.png";
  Run();
  ASSERT_FALSE(fake_.Calls().empty()) << "a new mask is new input";
  EXPECT_THAT(fake_.Calls()[0],
              HasSubstr("--ImageReader.mask_path " + (workspace_ / "sfm/masks").string()));
  const auto at = std::find(sorted_.begin(), sorted_.end(), images_[1].name) - sorted_.begin();
  EXPECT_EQ(ReadFile(workspace_ / "sfm/masks" / (Aliases()[static_cast<size_t>(at)] + ".png"), 100),
            "first");
  fake_.ForgetCalls();
  Run();
  EXPECT_TRUE(fake_.Calls().empty());
  fs::remove(photos_ / "mask.png");
  WriteFileAtomically(photos_ / "mask.png", "second");
  Run();
  EXPECT_FALSE(fake_.Calls().empty());
}

TEST_F(RunSfmWithFake, CamerasAreSharedByGroupAndSize) {
  images_[1].camera_group = "camera two";
  images_[1].focal_prior_px.reset();
  images_[2].width_px = 480;
  images_[2].height_px = 640;
  images_[3].focal_prior_px = 600;
  Run();
  const auto calls = fake_.Calls();
  ASSERT_EQ(calls.size(), 3u + 2u);
  // In order of names: "a b.jpg" (camera two), "c.jpg" (upright), then the two others.
  EXPECT_THAT(calls[0],
              AllOf(HasSubstr("--ImageReader.single_camera 1"), Not(HasSubstr("camera_params"))));
  EXPECT_THAT(calls[1], HasSubstr("--ImageReader.camera_params 500,240,320,0"));
  EXPECT_THAT(calls[2], HasSubstr("--ImageReader.camera_params 600,320,240,0"));
  fake_.ForgetCalls();
  options_.share_intrinsics_within_group = false;
  Run();
  EXPECT_EQ(fake_.Calls().size(), 4u + 2u);
}

TEST_F(RunSfmWithFake, SequentialMatchingIsForVideo) {
  options_.matching = Matching::kSequential;
  Run();
  EXPECT_THAT(fake_.Calls()[1], HasSubstr("sequential_matcher"));
}

TEST_F(RunSfmWithFake, PairsThatResembleEachOtherLessAreLeftOutAndCounted) {
  options_.matching = Matching::kPreselected;
  const fs::path plaza = "datasets/plaza/images";
  for (size_t i = 0; i < sorted_.size(); ++i) {
    io::WriteImage(photos_ / sorted_[i], io::ReadImage(plaza / fmt::format("000{}.jpg", i)));
  }
  Run();
  EXPECT_THAT(listener_.notes, ElementsAre());  // all four show the same: nothing is left out
  // Grey photos resemble none: each is matched with the next alone.
  for (size_t i = 1; i < sorted_.size(); ++i) {
    io::WriteImage(photos_ / sorted_[i], ImageRgb8(64, 48, 3, std::uint8_t{128}));
  }
  Run();
  EXPECT_THAT(listener_.notes, ElementsAre("3 of 6 pairs of photos left out of matching: other "
                                           "photos resemble them more"));
}

TEST_F(RunSfmWithFake, RequestsThatCannotBeMeantAreUsageErrors) {
  options_.lens_model = "FISHBOWL";
  EXPECT_THROW(Run(), UsageError);
  options_.lens_model = "OPENCV";
  images_.push_back(images_.front());
  EXPECT_THROW(Run(), UsageError);
  images_.resize(1);
  EXPECT_THROW(Run(), UsageError);
  EXPECT_THAT(fake_.Calls(), ElementsAre());
}

TEST_F(RunSfmWithFake, PhotoThatCOLMAPCannotReadIsNamed) {
  auto aliases = Aliases();
  aliases.erase(aliases.begin() + 1);
  fake_.LeaveDatabase(aliases);
  EXPECT_THAT(MessageOfRun(), AllOf(HasSubstr("c.jpg"), HasSubstr("convert it")));
}

TEST_F(RunSfmWithFake, DatabaseThatIsNoneIsNamed) {
  WriteFileAtomically(fake_ / "database", "garbage");
  EXPECT_THAT(MessageOfRun(), HasSubstr("features.db"));
}

TEST_F(RunSfmWithFake, AbsentPhotoIsNamed) {
  fs::remove(photos_ / "c.jpg");
  EXPECT_THAT(MessageOfRun(), HasSubstr("c.jpg"));
}

TEST(Program, LaterVersionsAreSpokenToInTheirWords) {
  const testing::FakeColmap fake(true);
  Program program;
  Arguments arguments(program, "feature_extractor");
  arguments.Add({"SiftExtraction.use_gpu", "FeatureExtraction.use_gpu"}, "0")
      .AddIfKnown({"random_seed", "default_random_seed"}, "5")
      .AddIfKnown({"no_such_option"}, "1");
  EXPECT_THAT(arguments.argv(),
              ElementsAre("colmap", "feature_extractor", "--FeatureExtraction.use_gpu", "0",
                          "--default_random_seed", "5"));
  EXPECT_THROW(arguments.Add({"no_such_option"}, "1"), Error);
}

TEST(MatchingPercent, UnderstandsEveryMatchersLine) {
  EXPECT_EQ(MatchingPercent("Matching block [2/3, 1/3] in 0.061s"), 44);  // 4 of 9
  EXPECT_EQ(MatchingPercent("I2025 matching.cc:9] Processing block [3/3, 3/3]"), 100);
  EXPECT_EQ(MatchingPercent("I2025 matching.cc:9] Processing image [1/4]"), 25);
  EXPECT_EQ(MatchingPercent("Matching image [4/4] in 0.1s"), 100);
  EXPECT_EQ(MatchingPercent("Matching block [0/0, 1/0]"), -1);
  EXPECT_EQ(MatchingPercent("Elapsed time: 0.1 [minutes]"), -1);
}

TEST(PlanExtraction, FillsTheMemoryAndNeverMore) {
  const std::vector<SfmImageInput> photos(11, {"a.jpg", 2832, 2128, std::nullopt, ""});
  const auto plan = [&](int threads, double memory_gb, int side_px) {
    return PlanExtraction(photos, threads, memory_gb, side_px);
  };
  EXPECT_EQ(plan(2, 4, 0).threads, 2);
  EXPECT_EQ(plan(2, 4, 0).max_image_size_px, kPreferredSidePx);
  EXPECT_EQ(plan(16, 4, 0).threads, 2);
  EXPECT_EQ(plan(64, 64, 0).threads, 11);  // no more threads than photos
  EXPECT_EQ(plan(2, 4, 2832).threads, 1);  // two would take 3.6 of 3.6 GiB
  EXPECT_LT(plan(2, 1, 0).max_image_size_px, kPreferredSidePx);
  for (const double memory_gb : {0.5, 1.0, 2.0, 4.0, 8.0}) {
    EXPECT_LE(plan(8, memory_gb, 0).expected_peak_gib, kFill * memory_gb);
  }
  EXPECT_THAT([&] { plan(1, 0.1, 0); },
              ::testing::ThrowsMessage<UsageError>(HasSubstr("--memory 0.1: expected at least ")));
}

}  // namespace
}  // namespace dtr::colmap
