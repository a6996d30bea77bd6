#include "dtr/io/mesh_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/set_io.h"
#include "tests/io/small_mesh.h"
#include "tests/io/small_set.h"
#include "tests/support/test_data.h"
#include "tests/support/truncation.h"

namespace dtr::io {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using testing::TemporaryFolder;
using testing_support::SmallMesh;

constexpr size_t kFirstRoot = 8 + 4 * 4 + 2 * 32 + 3 * 8 + 8;  // docs/FORMAT.md

TEST(MeshFile, RoundTripsExactlyAndIsTheSameBytesTwice) {
  const TemporaryFolder folder;
  const auto file = folder / "mesh.bin";
  for (const bool everything : {false, true}) {
    StoredMesh mesh = SmallMesh();
    if (everything) {
      mesh.mask_sha256 = std::string(64, 'a');
      mesh.absolute_depth_break = 0;
    }
    WriteMesh(file, mesh);
    const std::string first = ReadFile(file, 1 << 20);
    EXPECT_EQ(first.size(), kFirstRoot + 2 * 6 + 2 * 4);
    const StoredMesh back = ReadMesh(file);
    EXPECT_EQ(back.depth_sha256, mesh.depth_sha256);
    EXPECT_EQ(back.mask_sha256, mesh.mask_sha256);
    EXPECT_EQ(back.resolution, 2);
    EXPECT_EQ(back.tolerance, 0.5);
    EXPECT_EQ(back.depth_break, 1.25);
    EXPECT_EQ(back.absolute_depth_break, mesh.absolute_depth_break);
    EXPECT_EQ(back.cover.columns, 34);
    EXPECT_EQ(back.cover.rows, 18);
    EXPECT_EQ(back.cover.rectangles, mesh.cover.rectangles);
    WriteMesh(file, back);
    EXPECT_EQ(ReadFile(file, 1 << 20), first);
  }
}

TEST(MeshFile, EveryTruncatedPrefixIsAnError) {
  const TemporaryFolder folder;
  WriteMesh(folder / "mesh.bin", SmallMesh());
  testing::ExpectEveryPrefixIsAnError(folder / "mesh.bin", 1,
                                      [&] { ReadMesh(folder / "mesh.bin"); });
}

TEST(MeshFile, RejectsHostileNumbers) {
  const TemporaryFolder folder;
  const auto file = folder / "mesh.bin";
  WriteMesh(file, SmallMesh());
  const std::string good = ReadFile(file, 1 << 20);
  const auto expect_rejected = [&](const std::string& content, const char* what) {
    WriteFileAtomically(file, content);
    EXPECT_THROW(ReadMesh(file), Error) << what;
  };
  expect_rejected(good + std::string(2, '\0'), "trailing bytes");
  const auto with = [&](size_t at, const std::string& bytes) {
    std::string bad = good;
    return bad.replace(at, bytes.size(), bytes);
  };
  expect_rejected(with(0, "X"), "magic");
  expect_rejected(with(8, std::string(4, '\0')), "resolution 0");
  expect_rejected(with(12, std::string(4, '\xff')), "columns beyond any image");
  expect_rejected(with(12, std::string("\x00\x00\x10\x00", 4)), "more root squares than bytes");
  expect_rejected(with(20, "\1"), "reserved bytes");
  expect_rejected(with(24, std::string(32, '\0')), "no depth hash");
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), -2.0}) {
    const std::string bytes(reinterpret_cast<const char*>(&bad), 8);
    for (const size_t at : {88u, 96u, 104u}) expect_rejected(with(at, bytes), "threshold");
  }
  expect_rejected(with(112, std::string(8, '\xff')), "number of rectangles");
  expect_rejected(with(kFirstRoot, std::string(2, '\xff')), "rectangles of a root square");
  expect_rejected(with(kFirstRoot, std::string(2, '\0')), "rectangles left over");
  expect_rejected(with(kFirstRoot + 2, "\x01"), "a rectangle beyond its root square and the map");
}

TEST(MeshFile, RejectsRectanglesThatOverlap) {
  const TemporaryFolder folder;
  const auto file = folder / "mesh.bin";
  StoredMesh mesh = SmallMesh();
  mesh.cover.rectangles = {{4, 0, 8, 8}, {12, 0, 1, 1}};  // side by side
  WriteMesh(file, mesh);
  EXPECT_EQ(ReadMesh(file).cover.rectangles, mesh.cover.rectangles);
  std::string overlapping = ReadFile(file, 1 << 20);
  overlapping[kFirstRoot + 4] = 11;  // the second one's place in its root square
  WriteFileAtomically(file, overlapping);
  EXPECT_THROW(ReadMesh(file), Error);
  mesh.cover.rectangles[1].x = 11;
  EXPECT_THROW(WriteMesh(file, mesh), Error);
}

TEST(MeshFile, WriterRejectsWhatTheReaderWould) {
  const TemporaryFolder folder;
  StoredMesh mesh = SmallMesh();
  mesh.cover.rectangles[0] = {30, 0, 16, 16};
  EXPECT_THROW(WriteMesh(folder / "m", mesh), Error);
  mesh = SmallMesh();
  mesh.tolerance = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(WriteMesh(folder / "m", mesh), Error);
  mesh = SmallMesh();
  std::swap(mesh.cover.rectangles[0], mesh.cover.rectangles[3]);  // not in the order of the squares
  EXPECT_THROW(WriteMesh(folder / "m", mesh), Error);
  EXPECT_FALSE(std::filesystem::exists(folder / "m"));
}

TEST(MeshFile, IsLoadedWithItsDepthAndOnlyForThatDepth) {
  const TemporaryFolder folder;
  SetWriter writer(folder / "small.dtr", testing_support::kFingerprint, false);
  DtrSet set = testing_support::EmptySet();
  set.frames[0].views = {testing_support::SmallView(0), testing_support::SmallView(1)};
  for (View& view : set.frames[0].views) {
    writer.WriteView(view, set.unit);
    StoredMesh mesh;
    mesh.cover.columns = view.depth.width(), mesh.cover.rows = view.depth.height();
    writer.WriteMesh(view, mesh);
  }
  // The depth of the second is written again, with another value: its mesh is gone.
  View& second = set.frames[0].views[1];
  second.depth(0, 0) = 7.5f;
  writer.WriteView(second, set.unit);
  EXPECT_FALSE(second.mesh_file.has_value());
  // The first one's mesh says it is of another depth map.
  writer.Finish(set);
  EXPECT_TRUE(VerifySet(folder / "small.dtr").empty());
  LoadOptions load;
  std::vector<std::string> warnings;
  load.warn = [&](const std::string& line) { warnings.push_back(line); };
  DtrSet loaded = LoadSet(folder / "small.dtr", load);
  View& first = loaded.frames[0].views[0];
  EXPECT_TRUE(first.mesh.has_value());
  EXPECT_FALSE(loaded.frames[0].views[1].mesh.has_value());
  EXPECT_THAT(warnings, IsEmpty());
  first.depth_file->sha256 = std::string(64, 'b');
  LoadPixels(folder / "small.dtr", first, load);
  EXPECT_FALSE(first.mesh.has_value());
  EXPECT_THAT(warnings, ElementsAre(HasSubstr(first.name + ": its reduced mesh is left out")));
}

TEST(MeshFile, ADamagedOrMissingOneCostsAWarningAndNotTheView) {
  const TemporaryFolder folder;
  const std::filesystem::path target = folder / "small.dtr";
  {
    SetWriter writer(target, testing_support::kFingerprint, false);
    DtrSet set = testing_support::EmptySet();
    set.frames[0].views = {testing_support::SmallView(0)};
    View& view = set.frames[0].views[0];
    writer.WriteView(view, set.unit);
    StoredMesh mesh;
    mesh.cover.columns = view.depth.width(), mesh.cover.rows = view.depth.height();
    writer.WriteMesh(view, mesh);
    writer.Finish(set);
  }
  const std::filesystem::path file = target / LoadSet(target).frames[0].views[0].mesh_file->path;
  const std::string whole = ReadFile(file, 1 << 20);
  const auto expect_left_out = [&](const char* what) {
    std::vector<std::string> warnings;
    LoadOptions load;
    load.warn = [&](const std::string& line) { warnings.push_back(line); };
    const DtrSet set = LoadSet(target, load);
    ASSERT_THAT(set.frames[0].views, SizeIs(1)) << what;
    EXPECT_FALSE(set.frames[0].views[0].mesh.has_value()) << what;
    EXPECT_FALSE(set.frames[0].views[0].depth.grid().empty()) << what;
    ASSERT_THAT(warnings, SizeIs(1)) << what;
    EXPECT_THAT(warnings[0], HasSubstr(file.filename().string())) << what;
    EXPECT_THAT(VerifySet(target), SizeIs(1)) << what;  // `dtr info --verify` still says so
  };
  for (const size_t at : {size_t{0}, size_t{40}, whole.size() - 1}) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 1);
    WriteFileAtomically(file, damaged);
    expect_left_out("a bit");
  }
  WriteFileAtomically(file, whole.substr(0, whole.size() / 2));
  expect_left_out("half");
  std::filesystem::remove(file);
  expect_left_out("nothing");
}

}  // namespace
}  // namespace dtr::io
