// Features before anything else: in what memory, of which cameras, and that they are kept.
#include "calib/colmap/features.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dtr/base/files.h"
#include "tests/calib/colmap/run_sfm_with_fake.h"
#include "tests/support/on_threads.h"

namespace dtr::colmap {
namespace {

using namespace sfm;

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::uintmax_t kFileLimit = 1 << 20;

class FeaturesWithFake : public testing::RunSfmWithFake {};

// 48 photos are a batch: what an interruption finds done of a later one is thrown away, what it
// finds of those before is kept, and later photos of a camera are of that which the first made.
TEST_F(FeaturesWithFake, FeaturesGoOnAfterTheLastWholeBatch) {
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
TEST_F(FeaturesWithFake, FeaturesOfOtherPhotosDoNotGoOn) {
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
TEST_F(FeaturesWithFake, ABatchThatTheNoteDoesNotKnowIsAskedForAgain) {
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
  // The closing brace is the last character that a whole note needs: only a newline follows it.
  for (size_t length = 0; length <= first.rfind('}'); length += 7) {
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

TEST_F(FeaturesWithFake, MasksLieWhereColmapLooksForThem) {
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

TEST_F(FeaturesWithFake, CamerasAreSharedByGroupAndSize) {
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

TEST_F(FeaturesWithFake, PhotoThatCOLMAPCannotReadIsNamed) {
  auto aliases = Aliases();
  aliases.erase(aliases.begin() + 1);
  fake_.LeaveDatabase(aliases);
  EXPECT_THAT(MessageOfRun(), AllOf(HasSubstr("c.jpg"), HasSubstr("convert it")));
}

TEST_F(FeaturesWithFake, DatabaseThatIsNoneIsNamed) {
  WriteFileAtomically(fake_ / "database", "garbage");
  EXPECT_THAT(MessageOfRun(), HasSubstr("features.db"));
}

TEST(PlanExtraction, FillsTheMemoryAndNeverMore) {
  const std::vector<SfmImageInput> photos(11, {"a.jpg", 2832, 2128, std::nullopt, ""});
  const auto plan = [&](int threads, double memory_gb, int side_px) {
    return OnThreads(threads, [&] { return PlanExtraction(photos, memory_gb, side_px); });
  };
  EXPECT_EQ(plan(2, 4, 0).threads, 2);
  EXPECT_EQ(plan(2, 4, 0).max_image_size_px, kPreferredSidePx);
  EXPECT_EQ(plan(16, 4, 0).threads, 2);
  EXPECT_EQ(plan(64, 64, 0).threads, 11);  // no more threads than photos
  EXPECT_EQ(plan(2, 4, 2832).threads, 1);  // two would take 3.6 of 3.6 GiB
  EXPECT_LT(plan(2, 1, 0).max_image_size_px, kPreferredSidePx);
  for (const double memory_gb : {0.5, 1.0, 2.0, 4.0, 8.0}) {
    EXPECT_LE(plan(8, memory_gb, 0).expected_peak_gib * 1.073741824, kFill * memory_gb);
  }
  EXPECT_THAT([&] { plan(1, 0.1, 0); },
              ::testing::ThrowsMessage<UsageError>(HasSubstr("`memory` 0.1: expected at least ")));
}

}  // namespace
}  // namespace dtr::colmap
