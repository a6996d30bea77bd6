// A dynamic set in which what stands still is stored once: the same numbers, fewer bytes, and one
// clear line where a base is not the right one.
#include "dtr/io/still_once.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dtr/base/error.h"
#include "dtr/io/code_differences.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/set_io.h"
#include "tests/io/small_set.h"
#include "tests/support/message_of.h"
#include "tests/support/on_threads.h"
#include "tests/support/test_data.h"
#include "tests/support/truncation.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::TemporaryFolder;
using namespace testing_support;

constexpr int kSteps = 7, kSide = 64;
constexpr double kFarZ = 400;

/// A noisy wall with holes, completed in part, before which a square moves.
View WallView(int camera, int step) {
  View view;
  view.id = "t000" + std::to_string(step) + "_cam" + std::to_string(camera);
  view.name = "cam" + std::to_string(camera);
  view.camera = PinholeCamera(kSide, kSide, 60, 60, kSide / 2, kSide / 2);
  view.cam_from_world.translation = {0.1 * camera, 0, 0};
  view.image = ImageRgb8(kSide, kSide, 3);
  view.depth = DepthImage(kSide, kSide);
  view.inverse_depth_sigma = Grid<float>(kSide, kSide);
  view.near_z = 1.5, view.far_z = 9;
  view.completed_near_z = 1.5, view.completed_far_z = kFarZ, view.completed_steps = 4000;
  DepthImage completed(kSide, kSide);
  Random wall(static_cast<std::uint64_t>(camera) + 1);
  Random square(static_cast<std::uint64_t>(100 * camera + step));
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      view.depth(x, y) = static_cast<float>(wall.Uniform(4, 5));
      (*view.inverse_depth_sigma)(x, y) = static_cast<float>(wall.Uniform(0.001, 0.01));
      if (x < 6) view.depth(x, y) = (*view.inverse_depth_sigma)(x, y) = 0;
      const bool changes = y >= 10 + 4 * step && y < 20 + 4 * step;
      if (x < 5) completed(x, y) = static_cast<float>(y < 15 ? kFarZ : wall.Uniform(5, 8));
      if (x < 5 && changes) completed(x, y) = static_cast<float>(square.Uniform(5, 8));
      if (x < 20 || x >= 30 || !changes) continue;
      view.depth(x, y) = static_cast<float>(square.Uniform(2, 3));
      (*view.inverse_depth_sigma)(x, y) = static_cast<float>(square.Uniform(0.001, 0.01));
    }
  }
  AddCompletedDepth(completed, view);
  return view;
}

/// Two cameras over time, as `change` leaves their views.
DtrSet WriteMovingSet(
    const fs::path& target, bool once, int threads = 1,
    const std::function<void(View&)>& change = [](View&) {}) {
  SetWriter writer(target, kFingerprint, false);
  DtrSet set = EmptySet();
  set.frames.resize(kSteps);
  for (int step = 0; step < kSteps; ++step) {
    for (int camera = 0; camera < 2; ++camera) {
      View view = WallView(camera, step);
      change(view);
      writer.WriteView(view, set.unit);
      set.frames[static_cast<size_t>(step)].views.push_back(std::move(view));
    }
  }
  SilentProgress silent;
  if (once) OnThreads(threads, [&] { return StoreStillOnce(writer.folder(), set, 1, silent); });
  writer.Finish(set);
  return set;
}

DtrSet LoadedWhole(const fs::path& set) {
  LoadOptions load;
  load.sigma = load.completed = true;
  return LoadSet(set, load);
}

std::uint64_t BytesIn(const fs::path& folder) {
  std::uint64_t bytes = 0;
  for (const auto& [name, content] : Contents(folder)) bytes += content.size();
  return bytes;
}

class StillOnce : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
  fs::path once_ = folder_ / "once.dtr", plain_ = folder_ / "plain.dtr";
};

TEST_F(StillOnce, EveryNumberIsTheSameInAFractionOfTheBytes) {
  WriteMovingSet(plain_, false);
  const DtrSet set = WriteMovingSet(once_, true);
  const DtrSet before = LoadedWhole(plain_), after = LoadedWhole(once_);
  for (size_t step = 0; step < kSteps; ++step) {
    for (size_t v = 0; v < 2; ++v) {
      const View &a = before.frames[step].views[v], &b = after.frames[step].views[v];
      EXPECT_EQ(a.depth.grid(), b.depth.grid());
      EXPECT_EQ(a.depth_state, b.depth_state);
      EXPECT_EQ(*a.inverse_depth_sigma, *b.inverse_depth_sigma);
      ASSERT_TRUE(b.depth_base && b.completed_base && b.sigma_base);
      EXPECT_EQ(b.depth_base, after.frames[0].views[v].depth_base) << "one for all time steps";
    }
  }
  // Of completed depth there is so little that what every file has (sizes, hashes) counts.
  for (const auto& [kind, share] :
       {std::pair("depth", 0.5), std::pair("completed", 0.7), std::pair("sigma", 0.5)}) {
    EXPECT_LT(BytesIn(once_ / kind) + BytesIn(once_ / "still" / kind),
              share * static_cast<double>(BytesIn(plain_ / kind)))
        << kind;
  }
  EXPECT_THAT(VerifySet(once_), IsEmpty());
}

TEST_F(StillOnce, SetsSayByTheirVersionThatTheyNeedIt) {
  WriteMovingSet(plain_, false);
  WriteMovingSet(once_, true);
  EXPECT_THAT(ReadFile(plain_ / "set.json", 1 << 24), HasSubstr("\"format_version\": 1,"));
  EXPECT_THAT(ReadFile(once_ / "set.json", 1 << 24), HasSubstr("\"format_version\": 2,"));
}

TEST_F(StillOnce, BytesAreTheSameForAnyNumberOfThreads) {
  WriteMovingSet(once_, true, 1);
  WriteMovingSet(plain_, true, 3);
  EXPECT_EQ(Contents(once_), Contents(plain_));
}

TEST_F(StillOnce, WhatMovesEverywhereStaysAsItIs) {
  Random random(1);
  const DtrSet set = WriteMovingSet(once_, true, 1, [&](View& view) {
    view.depth_coding = DepthCoding::kZstdInverseDepth;
    view.depth_steps = 60000;
    for (float& z : view.depth.grid().data()) {
      if (z > 0 && z < 9) z = static_cast<float>(random.Uniform(2, 8));
    }
  });
  EXPECT_FALSE(set.frames[0].views[0].depth_base);
  EXPECT_TRUE(set.frames[0].views[0].sigma_base);
  EXPECT_THAT(VerifySet(once_), IsEmpty());
}

TEST_F(StillOnce, FilesThatAreEqualAnywayStayAsTheyAre) {
  const DtrSet set = WriteMovingSet(once_, true, 1, [&](View& view) {
    view.depth = WallView(view.name == "cam0" ? 0 : 1, 0).depth;
  });
  EXPECT_FALSE(set.frames[3].views[0].depth_base);
  EXPECT_EQ(set.frames[3].views[0].depth_file, set.frames[0].views[0].depth_file);
}

TEST_F(StillOnce, CodingsThatDifferOrAreNoCodesStayAsTheyAre) {
  const DtrSet set = WriteMovingSet(once_, true, 1, [&](View& view) {
    if (view.name == "cam0") view.depth_coding = DepthCoding::kExrFloat;
    if (view.name == "cam1") view.near_z = view.id < "t0005" ? 1.5 : 1.6;
  });
  EXPECT_FALSE(set.frames[0].views[0].depth_base) << "float";
  ASSERT_TRUE(set.frames[0].views[1].depth_base && set.frames[6].views[1].depth_base);
  EXPECT_NE(set.frames[0].views[1].depth_base, set.frames[6].views[1].depth_base);
  LoadedWhole(once_);
}

TEST_F(StillOnce, EveryTruncatedPrefixIsAnError) {
  DtrSet set = WriteMovingSet(once_, true);
  View& view = set.frames[3].views[1];
  LoadOptions load;
  load.sigma = load.completed = true;
  for (const auto* file : {&view.depth_file, &view.completed_file, &view.sigma_file,
                           &view.depth_base, &view.completed_base, &view.sigma_base}) {
    testing::ExpectEveryPrefixIsAnError(once_ / (*file)->path, 7,
                                        [&] { LoadPixels(once_, view, load); });
  }
}

TEST_F(StillOnce, ABaseWithOtherContentIsNamed) {
  const DtrSet set = WriteMovingSet(once_, true);
  View view = set.frames[2].views[0];
  const std::string other = ReadFile(once_ / set.frames[2].views[1].depth_base->path, 1 << 24);
  WriteFileAtomically(once_ / view.depth_base->path, other);
  const std::string error = testing::MessageOf<Error>([&] { LoadPixels(once_, view, {}); });
  EXPECT_THAT(error, HasSubstr("still/depth/t0000_cam0.dtz: expected the content that the set "
                               "records, found another"));
  EXPECT_FALSE(VerifySet(once_).empty());
}

TEST_F(StillOnce, TheBaseOfAnotherCameraIsRejected) {
  const DtrSet set = WriteMovingSet(once_, true);
  View view = set.frames[2].views[0];
  view.depth_base = set.frames[2].views[1].depth_base;
  const std::string error = testing::MessageOf<Error>([&] { LoadPixels(once_, view, {}); });
  EXPECT_THAT(error, HasSubstr("depth/t0002_cam0.dtd: expected differences to "));
  EXPECT_THAT(error, HasSubstr("found differences to another base"));
}

TEST_F(StillOnce, ABaseThatIsDifferencesItselfIsRejected) {
  const DtrSet set = WriteMovingSet(once_, true);
  View view = set.frames[2].views[0];
  view.depth_base = set.frames[1].views[0].depth_file;
  const Grid<std::uint16_t> codes(kSide, kSide, 1, 7);
  WriteFileAtomically(once_ / view.depth_file->path,
                      EncodeDifferences(codes, codes, view.depth_base->sha256));
  const std::string error = testing::MessageOf<Error>([&] { LoadPixels(once_, view, {}); });
  EXPECT_THAT(error, HasSubstr("depth/t0001_cam0.dtd: coded depth: expected the magic DTRBAND1"));
}

TEST_F(StillOnce, ABaseInSetJsonIsChecked) {
  const DtrSet set = WriteMovingSet(once_, true);
  const std::string text = ReadFile(once_ / "set.json", 1 << 24);
  const auto error_after = [&](const std::string& from, const std::string& to) {
    std::string edited = text;
    edited.replace(edited.find(from), from.size(), to);
    WriteFileAtomically(once_ / "set.json", edited);
    return testing::MessageOf<Error>([&] { ReadSet(once_); });
  };
  const std::string path = "\"path\": \"still/depth/t0000_cam0.dtz\"";
  EXPECT_THAT(error_after(path, "\"path\": \"../a.dtz\""), HasSubstr("depth.base.path"));
  EXPECT_THAT(error_after(path, "\"path\": \"still/none.dtz\""), HasSubstr("depth.base.path"));
  EXPECT_THAT(error_after(path, "\"path\": \"held_out/a.dtz\""), HasSubstr("depth.base.path"));
  EXPECT_THAT(error_after(path, path + ", \"base\": {}"), HasSubstr("depth.base: expected path"));
  EXPECT_THAT(error_after("\"coding\": \"zstd-inverse\"", "\"coding\": \"exr-float\""),
              HasSubstr("depth.base: expected a base beside zstd-inverse only"));
}

TEST_F(StillOnce, InfoCountsEachFileOnce) {
  const DtrSet set = WriteMovingSet(once_, true);
  const std::string info = InfoJson(set);
  for (const char* part : {"images", "depth", "completed_depth", "sigma", "still_parts"}) {
    const std::string folder = std::string(part) == "completed_depth" ? "completed"
                               : std::string(part) == "still_parts"   ? "still"
                                                                      : part;
    EXPECT_THAT(info, HasSubstr("\"" + std::string(part) +
                                "\": " + std::to_string(BytesIn(once_ / folder))));
  }
}

}  // namespace
}  // namespace dtr::io
