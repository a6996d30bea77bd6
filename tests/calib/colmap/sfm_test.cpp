#include "calib/sfm/run/sfm.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <mutex>

#include "calib/colmap/features.h"
#include "calib/colmap/matching.h"
#include "calib/colmap/model_io.h"
#include "calib/sfm/run/held_out.h"
#include "calib/sfm/run/workspace.h"
#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/image_io.h"
#include "tests/calib/colmap/fake_colmap.h"
#include "tests/calib/colmap/model_test_support.h"
#include "tests/calib/colmap/run_sfm_with_fake.h"

namespace dtr::colmap {
namespace {

using namespace sfm;

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Pair;
using testing::RunSfmWithFake;

constexpr std::uintmax_t kFileLimit = 1 << 20;

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
                               "photo more; COLMAP registers a photo by 30 that agree"),
                          Pair("Über uns/b photo.JPG",
                               "in common with a photo alone that has no camera either, most with "
                               "d.png (40 features)")));
  EXPECT_THAT(why({{0, 2, 15}, {1, 2, 60}}),
              ElementsAre(Pair("d.png",
                               "60 of its 100 features in common with c.jpg, with no photo "
                               "more; COLMAP found no pose that they agree on with those "
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
  EXPECT_THAT(listener_.notes, Contains(HasSubstr("photos without a camera cannot be analysed: ")));
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
  const ThreadLimit one(1);  // threads and memory do not change what was asked
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

TEST_F(RunSfmWithFake, PhotosThatMatchWithoutParallaxAreReportedAsSuch) {
  fs::remove_all(fake_ / "model.0");
  fs::remove_all(fake_ / "model.1");
  // A turntable: COLMAP calls some pairs calibrated, others planar or panoramic, or a watermark.
  fake_.LeaveDatabase(Aliases(), {},
                      {{0, 1, 40, 2, true}, {0, 2, 40, 6, true}, {1, 2, 40, 7, true}, {2, 3, 40}});
  EXPECT_THAT(MessageOfRun(), AllOf(HasSubstr("3 of 4 matched pairs"),
                                    HasSubstr("at the same position"), HasSubstr("NAME_mask.png")));
  // A camera that only rotated.
  fs::remove_all(workspace_ / "sfm");
  fake_.LeaveDatabase(Aliases(), {}, {{0, 1, 40, 6}, {0, 2, 40, 5}, {1, 2, 40}});
  EXPECT_THAT(MessageOfRun(), AllOf(HasSubstr("2 of 3 matched pairs"), HasSubstr("no parallax"),
                                    HasSubstr("different positions")));
}

TEST_F(RunSfmWithFake, PhotosThatMatchButFitNoCameraAreNotCalledWithoutOverlap) {
  fs::remove_all(fake_ / "model.0");
  fs::remove_all(fake_ / "model.1");
  fake_.LeaveDatabase(Aliases(), {}, {{0, 1, 40}, {0, 2, 40}, {1, 2, 40}, {2, 3, 40}});
  EXPECT_THAT(MessageOfRun(), AllOf(HasSubstr("4 pairs of photos match"),
                                    HasSubstr("`camera_per` folder or photo")));
}

TEST_F(RunSfmWithFake, AModelOfPhotosMostlyWithoutParallaxIsRemarkedOn) {
  fake_.LeaveDatabase(Aliases(), {}, {{0, 1, 40, 2, true}, {0, 2, 40, 6, true}, {1, 2, 40}});
  EXPECT_THAT(Run().report.lack_of_parallax, HasSubstr("2 of 3 matched pairs"));
  EXPECT_THAT(listener_.notes, Contains(HasSubstr("2 of 3 matched pairs")));
  fs::remove_all(workspace_ / "sfm");
  fake_.LeaveDatabase(Aliases(), {}, {{0, 1, 40}, {0, 2, 40, 6}, {1, 2, 40}});
  EXPECT_EQ(Run().report.lack_of_parallax, "");
  fs::remove_all(workspace_ / "sfm");
  fake_.LeaveDatabase(Aliases(), {}, {{0, 1, 40}, {0, 2, 40}});
  EXPECT_THAT(Run().report.lack_of_parallax,
              HasSubstr("too few pairs of photos have features in common (2 among 4 photos); "
                        "photos that are dark, noisy, blurred or small have few"));
}

// What the mapper does with free intrinsics; with fixed ones it makes its model.
std::string UnlessFixed(const std::string& commands) {
  return "if ! tail -n 1 \"$here/calls\" | grep -q 'ba_refine_focal_length 0.*"
         "ba_refine_extra_params 0'; then " +
         commands + "; fi";
}
const std::string kOnlyFixed = UnlessFixed("echo 'ERROR: failed to create sparse model'; exit 1");

TEST_F(RunSfmWithFake, WithoutAModelTheFocalLengthsOfExifAreFixed) {
  fake_.Fail("mapper", kOnlyFixed);
  const SfmResult result = Run();
  EXPECT_EQ(result.model.images.size(), 3u);
  EXPECT_TRUE(result.report.fixed_intrinsics);
  EXPECT_FALSE(result.report.forward_motion);
  EXPECT_TRUE(Run().report.fixed_intrinsics) << "of a run that goes on from it, too";
  EXPECT_THAT(listener_.notes, Contains(HasSubstr("trying with those of EXIF, fixed")));
}

// The mapper leaves the two photos that it began with.
const std::string kTwoPhotosUnlessFixed =
    UnlessFixed("cp -r \"$here/model.0\" \"$output/0\"; exit 0");

TEST_F(RunSfmWithFake, AModelOfTheFirstTwoPhotosAloneIsAsGoodAsNone) {
  fake_.Fail("mapper", kTwoPhotosUnlessFixed);
  const SfmResult result = Run();
  EXPECT_EQ(result.model.images.size(), 3u);
  EXPECT_TRUE(result.report.fixed_intrinsics);
  EXPECT_THAT(listener_.notes, Contains(HasSubstr("trying with those of EXIF, fixed")));
}

TEST_F(RunSfmWithFake, AModelOfTwoPhotosStaysWhereNothingGivesMore) {
  fs::remove_all(fake_ / "model.1");
  const SfmResult result = Run();
  EXPECT_EQ(result.model.images.size(), 2u);
  EXPECT_FALSE(result.report.fixed_intrinsics);
  EXPECT_FALSE(result.report.forward_motion);
}

TEST_F(RunSfmWithFake, AFocalLengthThatExifDoesNotGiveIsNotFixed) {
  for (SfmImageInput& image : images_) image.focal_prior_px.reset();
  fake_.Fail("mapper", kOnlyFixed);
  fake_.LeaveDatabase(Aliases(), {}, {{0, 1, 40}});
  EXPECT_THAT(MessageOfRun(), HasSubstr("too little in common"));
  for (const std::string& call : fake_.Calls()) {
    EXPECT_THAT(call, Not(HasSubstr("ba_refine_focal_length"))) << call;
  }
}

TEST_F(RunSfmWithFake, MatchesAreMappedAgainWithFixedIntrinsics) {
  Run();
  fake_.ForgetCalls();
  const auto again =
      MapWithFixedIntrinsics(photos_.path(), images_, workspace_ / "sfm", options_, listener_);
  ASSERT_TRUE(again.has_value());
  EXPECT_EQ(again->model.images.size(), 3u);
  ASSERT_EQ(fake_.Calls().size(), 1u) << "features and matches are those of the first run";
  EXPECT_THAT(fake_.Calls()[0], HasSubstr("--Mapper.ba_refine_focal_length 0"));
  fake_.ForgetCalls();
  EXPECT_TRUE(
      MapWithFixedIntrinsics(photos_.path(), images_, workspace_ / "sfm", options_, listener_));
  EXPECT_TRUE(fake_.Calls().empty()) << "finished before";
  EXPECT_FALSE(Run().report.fixed_intrinsics) << "the first model stays";
}

TEST_F(RunSfmWithFake, AWalkStraightAheadStartsFromPhotosInLineWithWhatTheySee) {
  fake_.Fail("mapper",
             "if ! grep -q 'init_max_forward_motion 1' \"$here/calls\"; then "
             "echo '=> No good initial image pair found.'; "
             "echo 'ERROR: failed to create sparse model'; exit 1; fi");
  const SfmResult result = Run();
  EXPECT_EQ(result.model.images.size(), 3u);
  ASSERT_EQ(result.report.steps.size(), 5u);
  EXPECT_THAT(result.report.steps[2].argv, Not(Contains("--Mapper.init_max_forward_motion")));
  EXPECT_THAT(result.report.steps[3].argv, Contains("--Mapper.ba_refine_focal_length"));
  EXPECT_THAT(result.report.steps[4].argv, Contains("--Mapper.init_max_forward_motion"));
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

TEST_F(RunSfmWithFake, GarbageModelIsRejected) {
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

TEST_F(RunSfmWithFake, AbsentPhotoIsNamed) {
  fs::remove(photos_ / "c.jpg");
  EXPECT_THAT(MessageOfRun(), HasSubstr("c.jpg"));
}

TEST(Program, LaterVersionsAreSpokenToInTheirWords) {
  const testing::FakeColmap fake(true);
  Arguments arguments("feature_extractor");
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

}  // namespace
}  // namespace dtr::colmap
