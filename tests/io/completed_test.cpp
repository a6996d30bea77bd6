#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/set_io.h"
#include "tests/io/small_set.h"
#include "tests/support/message_of.h"
#include "tests/support/test_data.h"
#include "tests/support/truncation.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::TemporaryFolder;
using namespace testing_support;

constexpr double kFar = 400;

/// Of a view with one hole at (1, 1): holes at (2, 1) and (3, 1), too, the first completed, the
/// second far.
View CompletedView() {
  View view = SmallView(0);
  view.depth(2, 1) = view.depth(3, 1) = 0;
  view.completed_near_z = 1.5, view.completed_far_z = kFar, view.completed_steps = 4000;
  DepthImage completed(view.depth.width(), view.depth.height());
  completed(2, 1) = 3;
  completed(3, 1) = static_cast<float>(kFar);
  AddCompletedDepth(completed, view);
  return view;
}

DtrSet WriteCompletedSet(const fs::path& target) {
  SetWriter writer(target, kFingerprint, false);
  DtrSet set = EmptySet();
  set.frames[0].views = {CompletedView(), SmallView(1)};
  for (View& view : set.frames[0].views) writer.WriteView(view, set.unit);
  writer.Finish(set);
  return set;
}

class CompletedSet : public ::testing::Test {
 protected:
  void SetUp() override { WriteCompletedSet(set_); }
  View Loaded(bool completed) const {
    LoadOptions load;
    load.completed = completed;
    return LoadSet(set_, load).frames[0].views[0];
  }
  TemporaryFolder folder_;
  fs::path set_ = folder_ / "completed.dtr";
};

TEST_F(CompletedSet, StandsInTheHolesOfWhatWasMeasured) {
  const View view = Loaded(true);
  EXPECT_EQ(view.depth_state(0, 0), DepthState::kMeasured);
  EXPECT_EQ(view.depth_state(2, 1), DepthState::kCompleted);
  EXPECT_EQ(view.depth_state(3, 1), DepthState::kFar);
  EXPECT_NEAR(view.depth(2, 1), 3, 0.001);
  EXPECT_EQ(view.depth(3, 1), static_cast<float>(kFar));
  EXPECT_EQ(view.depth(1, 1), 0) << "what nobody completed stays a hole";
}

TEST_F(CompletedSet, IsLeftOutUnlessAskedFor) {
  const View view = Loaded(false);
  EXPECT_TRUE(view.depth_state.empty());
  EXPECT_EQ(view.depth(2, 1), 0);
  EXPECT_EQ(view.depth.grid(), MeasuredDepth(Loaded(true)).grid());
}

TEST_F(CompletedSet, TheMeasuredMapIsTheSameFileWithAndWithoutIt) {
  SetWriter writer(folder_ / "plain.dtr", kFingerprint, false);
  View plain = CompletedView();
  plain.depth = MeasuredDepth(plain);
  plain.depth_state = {};
  writer.WriteView(plain, LengthUnit::kMetre);
  EXPECT_EQ(plain.depth_file->sha256, ReadSet(set_).frames[0].views[0].depth_file->sha256);
}

TEST_F(CompletedSet, EveryPrefixOfItsFileIsRejected) {
  const fs::path file = set_ / ReadSet(set_).frames[0].views[0].completed_file->path;
  testing::ExpectEveryPrefixIsAnError(file, 1, [&] { Loaded(true); });
}

TEST_F(CompletedSet, ADepthThatIsBothIsRejected) {
  View view = ReadSet(set_).frames[0].views[0];
  DepthImage everywhere(view.camera.width_px(), view.camera.height_px());
  for (float& z : everywhere.grid().data()) z = 3;
  SetWriter writer(folder_ / "both.dtr", kFingerprint, false);
  DtrSet set = EmptySet();
  set.frames[0].views = {CompletedView()};
  View& both = set.frames[0].views[0];
  writer.WriteView(both, set.unit);
  writer.WriteCompleted(everywhere, both);
  writer.Finish(set);
  LoadOptions load;
  load.completed = true;
  EXPECT_THAT(testing::MessageOf<Error>([&] { LoadSet(folder_ / "both.dtr", load); }),
              HasSubstr("expected no depth where depth/view0.png has some"));
}

TEST_F(CompletedSet, FieldsOutOfRangeAreRejected) {
  const std::string text = ReadFile(set_ / "set.json", 1 << 20);
  const auto error_after = [&](const std::string& from, const std::string& to) {
    const size_t at = text.find(from, text.find("completed_depth"));
    std::string edited = text;
    edited.replace(at, from.size(), to);
    WriteFileAtomically(set_ / "set.json", edited);
    return testing::MessageOf<Error>([&] { ReadSet(set_); });
  };
  EXPECT_THAT(error_after("\"steps\": 4000", "\"steps\": 70000"),
              HasSubstr("completed_depth.steps: expected 1 to 65534, found 70000"));
  EXPECT_THAT(error_after("\"near_z\": 1.5", "\"near_z\": -1"),
              HasSubstr("completed_depth.near_z: expected a positive number"));
  EXPECT_THAT(error_after("\"near_z\": 1.5", "\"near_z\": 500"),
              HasSubstr("completed_depth.far_z: expected more than near_z"));
}

}  // namespace
}  // namespace dtr::io
