#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/run_record_json.h"
#include "dtr/io/set_io.h"
#include "tests/io/small_set.h"
#include "tests/support/message_of.h"
#include "tests/support/on_threads.h"
#include "tests/support/test_data.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::MessageOf;
using testing::TemporaryFolder;
using namespace testing_support;

TEST(SetWriter, LaysTheFilesOutAsDocumented) {
  const TemporaryFolder folder;
  WriteSmallSet(folder / "small.dtr");
  std::vector<std::string> names;
  for (const auto& [name, content] : Contents(folder / "small.dtr")) names.push_back(name);
  EXPECT_THAT(names, ::testing::ElementsAre(
                         "depth/view0.png", "depth/view1.png", "held_out/files.json",
                         "held_out/images/view2.png", "images/view0.png", "images/view1.png",
                         "mask/view1.png", "set.json", "sigma/view1.exr", "sparse.bin"));
  EXPECT_FALSE(fs::exists(folder / "small.dtr.partial"));
}

TEST(SetWriter, WritesTheSameBytesTwiceAndForAnyThreads) {
  const TemporaryFolder folder;
  WriteSmallSet(folder / "a.dtr");
  const auto first = Contents(folder / "a.dtr");
  DtrSet set = EmptySet();
  set.frames[0].views = {SmallView(0), SmallView(1), SmallView(2, ViewRole::kHeldOut)};
  {
    SetWriter writer(folder / "b.dtr/", kFingerprint, false);  // a trailing slash changes nothing
    OnThreads(3, [&] {
      return ParallelFor(0, 3, [&](int i) {
        writer.WriteView(set.frames[0].views[static_cast<size_t>(i)], set.unit);
      });
    });
    writer.WriteSparse(set, {{{{0, 0, 5}}}, {{0, 0, {1, 2}}, {1, 0, {3, 4}}}});
    writer.Finish(set);
  }
  EXPECT_EQ(Contents(folder / "b.dtr"), first);
}

TEST(SetWriter, AnInterruptedRunIsResumedAndTheTargetUntouched) {
  const TemporaryFolder folder;
  const fs::path target = folder / "small.dtr";
  View first = SmallView(0), second = SmallView(1);
  {
    SetWriter writer(target, kFingerprint, false);
    EXPECT_FALSE(writer.resumed());
    EXPECT_FALSE(writer.RestoreView(first));
    writer.WriteView(first, LengthUnit::kMetre);
    View half = SmallView(1);  // its image is finished, its depth is not
    half.depth = {};
    half.inverse_depth_sigma.reset();
    writer.WriteView(half, LengthUnit::kMetre);
  }
  EXPECT_FALSE(fs::exists(target));
  ASSERT_TRUE(fs::exists(folder / "small.dtr.partial"));

  SetWriter writer(target, R"({"options": {"seed": 1},   "photos": ["a", "b"]})", false);
  EXPECT_TRUE(writer.resumed());  // the order of keys does not matter
  View restored = SmallView(0);
  restored.image = {};
  restored.depth = {};
  ASSERT_TRUE(writer.RestoreView(restored));
  EXPECT_EQ(restored.image_file, first.image_file);
  EXPECT_EQ(restored.depth_file, first.depth_file);
  EXPECT_EQ(restored.near_z, first.near_z);
  LoadPixels(writer.folder(), restored, {});
  EXPECT_EQ(restored.image, first.image);
  ASSERT_TRUE(writer.RestoreView(second));
  EXPECT_TRUE(second.image_file);
  EXPECT_FALSE(second.depth_file);

  View other_pose = SmallView(0);
  other_pose.cam_from_world.translation.x() += 1e-12;
  EXPECT_FALSE(writer.RestoreView(other_pose));
  WriteFileAtomically(writer.folder() / "depth/view0.png", "damaged");
  EXPECT_FALSE(writer.RestoreView(restored));

  EXPECT_TRUE(WriteSmallSet(writer).frames[0].views[1].depth_file);
  EXPECT_THAT(VerifySet(target), IsEmpty());
  EXPECT_FALSE(fs::exists(folder / "small.dtr.partial"));
}

TEST(SetWriter, ResumedAndStraightRunsGiveTheSameBytes) {
  const TemporaryFolder folder;
  WriteSmallSet(folder / "straight.dtr");
  {
    SetWriter writer(folder / "resumed.dtr", kFingerprint, false);
    View view = SmallView(0);
    writer.WriteView(view, LengthUnit::kMetre);
    View stale = SmallView(7);  // the next run does not come back to this one
    writer.WriteView(stale, LengthUnit::kMetre);
    WriteFileAtomically(writer.work_folder() / "checkpoint", "of some other stage");
  }
  WriteSmallSet(folder / "resumed.dtr");
  EXPECT_EQ(Contents(folder / "resumed.dtr"), Contents(folder / "straight.dtr"));
}

TEST(SetWriter, OtherFingerprintsForeignFoldersAndFilesAreUsageErrors) {
  const TemporaryFolder folder;
  const fs::path target = folder / "small.dtr";
  {
    SetWriter writer(target, kFingerprint, false);
    View view = SmallView(0);
    writer.WriteView(view, LengthUnit::kMetre);
  }
  const auto before = Contents(folder.path());
  EXPECT_THROW(SetWriter(target, R"({"other": 1})", false), UsageError);
  EXPECT_THROW(SetWriter(target, R"({"other": 1})", true), UsageError);
  EXPECT_EQ(Contents(folder.path()), before);

  WriteFileAtomically(folder / "file.dtr.partial", "a file");
  EXPECT_THROW(SetWriter(folder / "file.dtr", "{}", true), UsageError);
  fs::create_directories(folder / "foreign.dtr.partial");
  WriteFileAtomically(folder / "foreign.dtr.partial/precious", "work");
  EXPECT_THROW(SetWriter(folder / "foreign.dtr", "{}", true), UsageError);
  EXPECT_TRUE(fs::exists(folder / "foreign.dtr.partial/precious"));
  EXPECT_THROW(SetWriter(folder / "new.dtr", "[1]", false), Error);
  EXPECT_THROW(SetWriter(folder / "new.dtr", "{", false), Error);
}

TEST(SetWriter, AFailureBeforeAnyWorkLeavesNothing) {
  const TemporaryFolder folder;
  { SetWriter writer(folder / "small.dtr", kFingerprint, false); }
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(SetWriter, OneProcessAtATime) {
  const TemporaryFolder folder;
  SetWriter writer(folder / "small.dtr", kFingerprint, false);
  EXPECT_THROW(SetWriter(folder / "small.dtr", kFingerprint, false), UsageError);
  EXPECT_NO_THROW(WriteSmallSet(writer));
}

TEST(SetWriter, WorkThatIsDiscardedStandsInNobodysWay) {
  const TemporaryFolder folder;
  {
    SetWriter writer(folder / "small.dtr", kFingerprint, false);
    WriteFileAtomically(writer.work_folder() / "frames", "chosen");
    writer.Discard();
  }
  EXPECT_FALSE(fs::exists(folder / "small.dtr.partial"));
  EXPECT_NO_THROW(SetWriter(folder / "small.dtr", R"({"other": 1})", false));
}

TEST(SetWriter, WhatAKilledProcessHadBegunToWriteIsInNoSet) {
  const TemporaryFolder folder;
  const fs::path target = folder / "small.dtr";
  WriteSmallSet(folder / "straight.dtr");
  const auto whole = Contents(folder / "straight.dtr");
  const std::vector<std::string> begun = {"set.json.tmp77",        "report/run.json.tmp4194304",
                                          "images/view0.png.tmp1", "held_out/files.json.tmp12",
                                          "sparse.bin.tmp9",       "work/fingerprint.json.tmp5"};
  const auto leave = [&](const std::string& name) {
    const fs::path file = target.string() + ".partial/" + name;
    fs::create_directories(file.parent_path());
    std::ofstream(file) << "half";
  };
  Random random(3);
  constexpr int kRuns = 12;
  for (int run = 0; run < kRuns; ++run) {
    if (run == 0) {
      leave("work/fingerprint.json.tmp5");  // all there is: killed at the very first file
    } else {
      {
        SetWriter writer(target, kFingerprint, false);
        View view = SmallView(0);
        writer.WriteView(view, LengthUnit::kMetre);
      }
      for (int i = 0; i < 3; ++i) {
        leave(begun[static_cast<size_t>(random.Index(static_cast<int>(begun.size())))]);
      }
    }
    {
      SetWriter writer(target, kFingerprint, false);
      EXPECT_EQ(writer.resumed(), run > 0);
      WriteSmallSet(writer);
    }
    ASSERT_EQ(Contents(target), whole) << run;
    fs::remove_all(target);
  }
}

TEST(SetWriter, CopiesOfFilesThatMayOnlyBeReadCanBeReplaced) {
  const TemporaryFolder folder;
  const DtrSet set = WriteSmallSet(folder / "from.dtr");
  const auto& views = set.frames[0].views;
  for (const View& view : views) {
    fs::permissions(folder / "from.dtr" / view.image_file->path, fs::perms(0444));
  }
  SetWriter writer(folder / "to.dtr", kFingerprint, false);
  for (const View& view : views) writer.CopyFiles(folder / "from.dtr", view);
  const fs::path copy = writer.folder() / views[0].image_file->path;
  EXPECT_NE(fs::status(copy).permissions() & fs::perms::owner_write, fs::perms::none);
  fs::permissions(copy, fs::perms(0444));  // as an earlier run left it
  EXPECT_NO_THROW(writer.CopyFiles(folder / "from.dtr", views[0]));
}

TEST(SetWriter, FinishRejectsWhatReadSetWouldAndKeepsTheWork) {
  const TemporaryFolder folder;
  SetWriter writer(folder / "small.dtr", kFingerprint, false);
  DtrSet set = EmptySet();
  EXPECT_THROW(writer.Finish(set), Error);  // no view
  set.frames[0].views = {SmallView(0)};
  EXPECT_THROW(writer.Finish(set), Error);  // no image file
  writer.WriteView(set.frames[0].views[0], set.unit);
  set.frames[0].views[0].cam_from_world.translation.x() = std::numeric_limits<double>::quiet_NaN();
  try {
    writer.Finish(set);
    ADD_FAILURE() << "a NaN pose was written";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("views[0].cam_from_world.translation[0]: expected a number"));
  }
  set.frames[0].views[0].cam_from_world.translation.x() = 0;
  writer.WriteSparse(set, {{{{0, 0, 5}}}, {{1, 0, {1, 2}}}});  // there is no view 1
  EXPECT_THROW(writer.Finish(set), Error);
  EXPECT_FALSE(fs::exists(folder / "small.dtr"));
  writer.WriteSparse(set, {{{{0, 0, 5}}}, {{0, 0, {1, 2}}}});
  EXPECT_NO_THROW(writer.Finish(set));
  EXPECT_THAT(VerifySet(folder / "small.dtr"), IsEmpty());
}

TEST(SetWriter, ViewsThatDoNotFitAreRejected) {
  const TemporaryFolder folder;
  SetWriter writer(folder / "small.dtr", kFingerprint, false);
  const auto expect_rejected = [&](const auto& change) {
    View view = SmallView(1);
    change(view);
    EXPECT_THROW(writer.WriteView(view, LengthUnit::kUnknown), Error);
  };
  expect_rejected([](View& v) { v.id = "../x"; });
  expect_rejected([](View& v) { v.image = ImageRgb8(8, 7, 3); });
  expect_rejected([](View& v) { v.mask = Mask(7, 6); });
  expect_rejected([](View& v) { v.depth_scale = 1; });
  expect_rejected([](View& v) { v.depth_scale = 3; });
  expect_rejected([](View& v) { v.inverse_depth_sigma = Grid<float>(8, 6); });
  expect_rejected([](View& v) { v.role = ViewRole::kHeldOut; });
  expect_rejected([](View& v) { v.depth(0, 0) = -1; });
  expect_rejected([](View& v) { v.near_z = 5, v.far_z = 6; });
  expect_rejected([](View& v) { v.depth_coding = DepthCoding::kPng16Millimetre; });  // no metres
  expect_rejected([](View& v) { v.name = "\xff\xfe.jpg"; });                         // no UTF-8
}

TEST(SetWriter, EveryCodingIsReadBackWithinItsRange) {
  for (const auto coding :
       {DepthCoding::kExrFloat, DepthCoding::kExrHalf, DepthCoding::kPng16Millimetre,
        DepthCoding::kPng16InverseDepth, DepthCoding::kZstdInverseDepth}) {
    const TemporaryFolder folder;
    DtrSet set = EmptySet();
    set.frames[0].views = {SmallView(0), SmallView(3)};
    set.frames[0].views[1].depth = DepthImage(kWidthPx, kHeightPx);  // holes only
    {
      SetWriter writer(folder / "small.dtr", kFingerprint, false);
      for (View& view : set.frames[0].views) {
        view.depth_coding = coding;
        if (coding == DepthCoding::kZstdInverseDepth) view.depth_steps = 1000;
        writer.WriteView(view, set.unit);
      }
      writer.Finish(set);
    }
    const DtrSet loaded = LoadSet(folder / "small.dtr");
    const View& view = set.frames[0].views[0];
    EXPECT_EQ(loaded.frames[0].views[0].depth, RoundToCoding(view.depth, FormatOf(view, set.unit)));
    EXPECT_EQ(loaded.frames[0].views[1].depth, set.frames[0].views[1].depth);
  }
}

TEST(SetWriter, RecodedDepthKeepsItsBoundItsRangeAndTheCheckpoint) {
  const TemporaryFolder folder;
  DtrSet set = EmptySet();
  set.frames[0].views = {SmallView(0)};
  View& view = set.frames[0].views[0];
  constexpr double kError = 1e-3;  // 1 / metre
  const auto before = view.depth;
  SetWriter writer(folder / "small.dtr", kFingerprint, false);
  writer.WriteView(view, set.unit);
  const auto first = *view.depth_file;
  SetDepthError(view, kError);
  writer.RecodeDepth(view, set.unit);
  View restored = SmallView(0);
  ASSERT_TRUE(writer.RestoreView(restored));
  EXPECT_EQ(restored.depth_file, first);  // so that an interrupted run recodes the same depth
  writer.Finish(set);
  const View loaded = LoadSet(folder / "small.dtr").frames[0].views[0];
  EXPECT_EQ(loaded.depth_steps, view.depth_steps);
  EXPECT_EQ(loaded.depth_file->path, "depth/view0.dtz");
  EXPECT_FALSE(fs::exists(folder / "small.dtr" / first.path));
  for (size_t i = 0; i < before.grid().data().size(); ++i) {
    const double z = before.grid().data()[i], stored = loaded.depth.grid().data()[i];
    ASSERT_EQ(z == 0, stored == 0);
    if (z == 0) continue;
    ASSERT_LE(std::abs(1 / stored - 1 / z), kError);
  }
  EXPECT_THAT(VerifySet(folder / "small.dtr"), IsEmpty());
}

TEST(SetWriter, CopiesFilesAndRejectsDamagedOnes) {
  const TemporaryFolder folder;
  const DtrSet from = WriteSmallSet(folder / "from.dtr");
  {
    SetWriter writer(folder / "to.dtr", kFingerprint, false);
    DtrSet copy = from;
    copy.sparse_file.reset();
    for (View& view : copy.frames[0].views) writer.CopyFiles(folder / "from.dtr", view);
    View& view = copy.frames[0].views[0];
    view.image = SmallView(0).image;
    writer.WriteJpeg(view, 80);
    EXPECT_EQ(view.image_file->path, "images/view0.jpg");
    writer.Finish(copy);
  }
  const DtrSet to = LoadSet(folder / "to.dtr", {.held_out = true});
  EXPECT_EQ(to.frames[0].views[1].image_file, from.frames[0].views[1].image_file);
  EXPECT_EQ(to.frames[0].views[2].image_file->sha256, from.frames[0].views[2].image_file->sha256);
  const fs::path depth = folder / "from.dtr" / from.frames[0].views[0].depth_file->path;
  WriteFileAtomically(depth, "else");
  SetWriter writer(folder / "third.dtr", kFingerprint, false);
  EXPECT_THROW(writer.CopyFiles(folder / "from.dtr", from.frames[0].views[0]), Error);
}

TEST(SetWriter, JpegIsForSourcesOnly) {
  const TemporaryFolder folder;
  SetWriter writer(folder / "small.dtr", kFingerprint, false, ImageCoding::kJpeg);
  WriteSmallSet(writer);
  EXPECT_TRUE(fs::exists(folder / "small.dtr/images/view0.jpg"));
  EXPECT_TRUE(fs::exists(folder / "small.dtr/held_out/images/view2.png"));
  EXPECT_NO_THROW(LoadSet(folder / "small.dtr", {.held_out = true}));
}

TEST(RewriteMetadata, ChangesTheValidationResultAndNothingElse) {
  const TemporaryFolder folder;
  const fs::path target = folder / "small.dtr";
  WriteSmallSet(target);
  auto before = Contents(target);
  DtrSet set = ReadSet(target);
  set.validation_json = R"({"passed":true})";
  RewriteMetadata(target, set);
  EXPECT_EQ(ReadSet(target).validation_json, R"({"passed":true})");
  auto after = Contents(target);
  before.erase("set.json");
  after.erase("set.json");
  EXPECT_EQ(after, before);
  set.frames[0].views[0].gain.x() = 0;
  EXPECT_THROW(RewriteMetadata(target, set), Error);
}

TEST(WriteRunRecord, LiesOutsideTheHashes) {
  const TemporaryFolder folder;
  WriteSmallSet(folder / "small.dtr");
  RunRecord record;
  record.command = {"dtr", "build"};
  record.stages = {{"stereo", 1.5, 2.5, 1000}};
  WriteRunRecord(folder / "small.dtr", record, {{"note", 1}});
  EXPECT_THAT(VerifySet(folder / "small.dtr"), IsEmpty());
  const std::string text = ReadFile(folder / "small.dtr/report/run.json", 1 << 20);
  for (const char* field : {"\"host\"", "\"cores\"", "\"wall_s\": 1.5", "\"note\": 1"}) {
    EXPECT_THAT(text, HasSubstr(field));
  }
}

}  // namespace
}  // namespace dtr::io
