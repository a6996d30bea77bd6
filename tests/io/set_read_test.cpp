#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/random.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/set_io.h"
#include "dtr/io/set_json.h"
#include "tests/io/small_set.h"
#include "tests/support/test_data.h"
#include "tests/support/truncation.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using testing::TemporaryFolder;
using namespace testing_support;

std::string Text(const fs::path& file) { return ReadFile(file, 1 << 24); }

// What `read` says when it throws Error, or "" when it does not.
template <typename Read>
std::string ErrorOf(const Read& read) {
  try {
    read();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

// A small set whose set.json is edited by replacing text.
class EditedSet : public ::testing::Test {
 protected:
  void SetUp() override {
    WriteSmallSet(set_);
    text_ = Text(set_ / "set.json");
  }
  // The error after replacing the first `from` behind `after`; the edit is undone by the next one.
  std::string ErrorAfter(const std::string& after, const std::string& from, const std::string& to) {
    const size_t start = text_.find(after);
    const size_t at = text_.find(from, start);
    EXPECT_NE(at, std::string::npos) << from;
    std::string edited = text_;
    edited.replace(at, from.size(), to);
    WriteFileAtomically(set_ / "set.json", edited);
    return ErrorOf([&] { ReadSet(set_); });
  }
  TemporaryFolder folder_;
  fs::path set_ = folder_ / "small.dtr";
  std::string text_;
};

TEST_F(EditedSet, IsGoodBeforeTheEdit) {
  EXPECT_EQ(ErrorOf([&] { ReadSet(set_); }), "");
  EXPECT_THAT(VerifySet(set_), IsEmpty());
}

TEST_F(EditedSet, EveryTruncatedPrefixOfSetJsonIsAnError) {
  // Without its final line break the text is still whole.
  WriteFileAtomically(set_ / "set.json", text_.substr(0, text_.size() - 1));
  testing::ExpectEveryPrefixIsAnError(set_ / "set.json", 13, [&] { ReadSet(set_); });
}

TEST_F(EditedSet, RandomDamageIsAnErrorOrASetButNothingElse) {
  constexpr int kMutations = 2000;
  Random random(11);
  int refused = 0;
  for (int i = 0; i < kMutations; ++i) {
    std::string damaged = text_;
    for (int n = 1 + random.Index(3); n > 0; --n) {
      const auto at = static_cast<size_t>(random.Index(static_cast<int>(damaged.size())));
      const auto bytes = static_cast<size_t>(random.Index(4));
      switch (random.Index(3)) {
        case 0:
          damaged[at] = static_cast<char>(random.Index(256));
          break;
        case 1:
          damaged.erase(at, bytes);
          break;
        default:
          damaged.insert(at, text_.substr(at / 2, bytes));
          break;
      }
    }
    refused += ErrorOf([&] { SetFromJson(damaged, "set.json"); }).empty() ? 0 : 1;
  }
  EXPECT_GT(refused, kMutations / 2);  // the rest hit names, free text or digits
}

TEST_F(EditedSet, ErrorsNameFileFieldExpectedAndFound) {
  const std::string error = ErrorAfter("\"view1\"", "\"fx_px\": 11.1", "\"fx_px\": -1");
  EXPECT_EQ(error, (set_ / "set.json").string() +
                       ": frames[0].views[1].camera.fx_px: expected a positive number, found -1");
}

TEST_F(EditedSet, WrongVersionsAndFormatsAreRejected) {
  EXPECT_THAT(ErrorAfter("", "\"format_version\": 1", "\"format_version\": 3"),
              HasSubstr("format_version: expected 1 or 2, found 3"));
  EXPECT_THAT(ErrorAfter("", "\"format_version\": 1", "\"format_version\": \"1\""),
              HasSubstr("format_version"));
  EXPECT_THAT(ErrorAfter("", "dtr-set", "cameras"), HasSubstr("format: expected"));
  EXPECT_THAT(ErrorAfter("", "\"metre\"", "\"feet\""), HasSubstr("unit: expected"));
}

TEST_F(EditedSet, NumbersThatAreNoneAreRejected) {
  for (const char* bad : {"1e999", "-1e999", "null", "\"1\"", "NaN", "[1]", "true"}) {
    EXPECT_NE(ErrorAfter("", "\"cx_px\": 4.05", std::string("\"cx_px\": ") + bad), "") << bad;
    EXPECT_NE(ErrorAfter("\"translation\"", "0.0", bad), "") << bad;
  }
  EXPECT_THAT(ErrorAfter("", "\"cx_px\": 4.05", "\"cx_px\": null"),
              HasSubstr("views[0].camera.cx_px: expected a number, found null"));
}

TEST_F(EditedSet, PosesMustBeRotations) {
  EXPECT_THAT(ErrorAfter("\"rotation_wxyz\": [", "0.", "3."),
              HasSubstr("cam_from_world.rotation_wxyz: expected a quaternion of length 1"));
  EXPECT_THAT(ErrorAfter("", "\"rotation_wxyz\": [", "\"rotation_wxyz\": [1, "),
              HasSubstr("expected 4 numbers"));
}

TEST_F(EditedSet, FieldsOutOfRangeAreRejected) {
  EXPECT_THAT(ErrorAfter("", "\"width_px\": 8,\n", "\"width_px\": 0,\n"), HasSubstr("width_px"));
  EXPECT_THAT(ErrorAfter("", "\"width_px\": 8,\n", "\"width_px\": 2000000000,\n"),
              HasSubstr("at most"));
  EXPECT_THAT(ErrorAfter("", "\"scale\": 2", "\"scale\": 3"), HasSubstr("depth.scale: expected"));
  EXPECT_THAT(ErrorAfter("", "\"near_z\": ", "\"near_z\": 1000"), HasSubstr("depth.far_z"));
  EXPECT_THAT(ErrorAfter("", "\"near_z\": ", "\"near_z\": -"), HasSubstr("depth.near_z"));
  EXPECT_THAT(ErrorAfter("", "png16-inverse", "png17"), HasSubstr("depth.coding: expected"));
  EXPECT_THAT(ErrorAfter("", "plane-z", "ray"), HasSubstr("depth.kind: expected"));
  EXPECT_THAT(ErrorAfter("", "\"reference_baseline\": 0.25", "\"reference_baseline\": -1"),
              HasSubstr("reference_baseline"));
  EXPECT_THAT(ErrorAfter("\"gain_linear_rgb\"", "1.01", "0"), HasSubstr("gain_linear_rgb"));
  EXPECT_THAT(ErrorAfter("", "\"held_out\",", "\"kept\","), HasSubstr("role: expected"));
  EXPECT_THAT(ErrorAfter("", "\"min\": [", "\"max\": ["), HasSubstr("twice"));
}

TEST_F(EditedSet, IdsMustBeUniqueAndSafe) {
  EXPECT_THAT(ErrorAfter("", "\"id\": \"view1\"", "\"id\": \"view0\""),
              HasSubstr("views[1].id: expected an id that no other view has"));
  for (const char* bad : {"", "../x", "a/b", ".hidden", "a b"}) {
    EXPECT_THAT(ErrorAfter("", "\"id\": \"view1\"", "\"id\": \"" + std::string(bad) + "\""),
                HasSubstr("views[1].id"));
  }
}

TEST_F(EditedSet, NamesMustStayInTheFolderTheyArePutInto) {
  for (const char* bad : {"", "/etc/passwd", "../../x.png", "left/../../x.png", "left/", "a\\nb"}) {
    EXPECT_THAT(ErrorAfter("\"view1\"", "photos/Säule 1.JPG", bad), HasSubstr("views[1].name"))
        << bad;
  }
  EXPECT_EQ(ErrorAfter("\"view1\"", "photos/Säule 1.JPG", "rig/left/..1.JPG"), "");
}

TEST_F(EditedSet, PathsMustStayInTheSet) {
  for (const char* bad : {"/etc/passwd", "../outside.png", "images/../../x", "images//view0.png",
                          "./images/view0.png", "images\\\\view0.png", "C:x", "", "images/"}) {
    EXPECT_THAT(ErrorAfter("", "images/view0.png", bad), HasSubstr("views[0].image.path")) << bad;
  }
}

TEST_F(EditedSet, SymbolicLinksOutOfTheSetAreRejected) {
  fs::rename(set_ / "images/view0.png", folder_ / "outside.png");
  fs::create_symlink(folder_ / "outside.png", set_ / "images/view0.png");
  EXPECT_THAT(ErrorOf([&] { ReadSet(set_); }),
              HasSubstr("frames[0].views[0].image.path: expected a file inside the set's folder"));
  EXPECT_THAT(VerifySet(set_), SizeIs(1));
}

TEST_F(EditedSet, HeldOutAndSourceFilesDoNotMix) {
  EXPECT_THAT(ErrorAfter("", "held_out/images/view2.png", "images/view0.png"),
              HasSubstr("views[2].image.path: expected a path in held_out/"));
  EXPECT_THAT(ErrorAfter("", "images/view0.png", "held_out/images/view2.png"),
              HasSubstr("views[0].image.path: expected a path outside held_out/"));
  EXPECT_THAT(ErrorAfter("\"view0\"", "\"source\"", "\"held_out\""),
              HasSubstr("views[0].depth: expected no depth in a held-out view"));
}

TEST_F(EditedSet, MissingFilesAndOtherSizesAreNamed) {
  fs::resize_file(set_ / "depth/view0.png", 50);
  EXPECT_THAT(ErrorOf([&] { ReadSet(set_); }), HasSubstr("views[0].depth.bytes: expected"));
  fs::remove(set_ / "depth/view0.png");
  EXPECT_THAT(ErrorOf([&] { ReadSet(set_); }),
              HasSubstr("views[0].depth.path: expected a file, found nothing"));
  EXPECT_THAT(VerifySet(set_), ElementsAre(HasSubstr("views[0].depth.path")));
}

TEST_F(EditedSet, DeepNestingIsRejected) {
  const std::string deep = std::string(100000, '[') + std::string(100000, ']');
  EXPECT_THAT(ErrorAfter("", "\"format\"", "\"deep\": " + deep + ", \"format\""),
              HasSubstr("nesting"));
}

TEST_F(EditedSet, MillimetresNeedMetres) {
  ErrorAfter("", "png16-inverse", "png16-mm");  // metre: good so far
  text_ = Text(set_ / "set.json");
  EXPECT_THAT(ErrorAfter("", "\"metre\"", "\"unknown\""), HasSubstr("views[0].depth.coding"));
}

TEST_F(EditedSet, VerifyFindsAWrongHash) {
  std::string bytes = Text(set_ / "images/view1.png");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  WriteFileAtomically(set_ / "images/view1.png", bytes);
  EXPECT_NO_THROW(ReadSet(set_));  // hashes are checked on demand
  EXPECT_THAT(VerifySet(set_), ElementsAre(HasSubstr("views[1].image.sha256: expected")));
}

TEST_F(EditedSet, HashesOfHeldOutFilesStandInHeldOutAlone) {
  const std::string hash = ReadSet(set_).frames[0].views[2].image_file->sha256;
  EXPECT_THAT(hash, SizeIs(64));
  EXPECT_EQ(text_.find(hash), std::string::npos);
  EXPECT_THAT(Text(set_ / "held_out/files.json"), HasSubstr(hash));
  std::string bytes = Text(set_ / "held_out/images/view2.png");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  WriteFileAtomically(set_ / "held_out/images/view2.png", bytes);
  EXPECT_THAT(VerifySet(set_), ElementsAre(HasSubstr("views[2].image.sha256: expected")));
}

TEST_F(EditedSet, EveryPrefixOfTheHeldOutListIsAnError) {
  const fs::path list = set_ / "held_out/files.json";
  const std::string text = Text(list);
  WriteFileAtomically(list, text.substr(0, text.size() - 1));  // whole without its line break
  testing::ExpectEveryPrefixIsAnError(list, 1, [&] { ReadSet(set_); });
}

TEST_F(EditedSet, TheHeldOutListMustFitTheSet) {
  const fs::path list = set_ / "held_out/files.json";
  const std::string good = Text(list);
  const auto error_after = [&](const std::string& from, const std::string& to) {
    std::string edited = good;
    const size_t at = edited.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    WriteFileAtomically(list, edited.replace(at, from.size(), to));
    return ErrorOf([&] { ReadSet(set_); });
  };
  EXPECT_THAT(error_after("view2.png", "view3.png"),
              HasSubstr("files.json: files[0].path: expected a held-out file of set.json"));
  EXPECT_THAT(error_after("view2.png", "../../images/view0.png"), HasSubstr("files[0].path"));
  EXPECT_THAT(error_after("\"bytes\": ", "\"bytes\": -"), HasSubstr("files[0].bytes"));
  EXPECT_THAT(error_after("\"sha256\": \"", "\"sha256\": \"X"), HasSubstr("files[0].sha256"));
  EXPECT_THAT(error_after("\"format_version\": 1", "\"format_version\": 9"),
              HasSubstr("format_version: expected 1"));
  EXPECT_THAT(error_after("\"files\": [", "\"files\": [], \"others\": ["),
              HasSubstr("files: expected an entry for 'held_out/images/view2.png'"));
  fs::remove(list);
  EXPECT_THAT(ErrorOf([&] { ReadSet(set_); }), HasSubstr("held_out/files.json: cannot be read"));
  EXPECT_THAT(VerifySet(set_), SizeIs(1));
}

TEST_F(EditedSet, VerifyOfABrokenSetIsAProblemNotAnException) {
  WriteFileAtomically(set_ / "set.json", text_.substr(0, 100));
  EXPECT_THAT(VerifySet(set_), SizeIs(1));
  EXPECT_THAT(VerifySet(folder_ / "absent.dtr"), SizeIs(1));
}

TEST_F(EditedSet, UnknownFieldsSurviveReadAndWrite) {
  std::string edited = text_;
  const auto insert = [&](const std::string& before, const std::string& field) {
    const size_t at = edited.find(before);
    ASSERT_NE(at, std::string::npos);
    edited.insert(at, field);
  };
  insert("\"format\"", "\"z_top\": {\"a\": [1, 2.5, null]},\n");
  insert("\"time_s\"", "\"frame_note\": \"ü\",\n");
  insert("\"id\"", "\"view_note\": 1e-7,\n");
  insert("\"fx_px\"", "\"skew_note\": true,\n");
  insert("\"coding\"", "\"depth_note\": \"kept\",\n");
  insert("\"min\"", "\"bounds_note\": 3,\n");
  WriteFileAtomically(set_ / "set.json", edited);
  RewriteMetadata(set_, ReadSet(set_));
  const std::string once = Text(set_ / "set.json");
  for (const char* field :
       {"\"z_top\": {", "\"frame_note\": \"ü\"", "\"view_note\": 1e-07", "\"skew_note\": true",
        "\"depth_note\": \"kept\"", "\"bounds_note\": 3"}) {
    EXPECT_THAT(once, HasSubstr(field));
  }
  RewriteMetadata(set_, ReadSet(set_));
  EXPECT_EQ(Text(set_ / "set.json"), once);
}

TEST(ReadSet, RejectsWhatIsNoSet) {
  const TemporaryFolder folder;
  EXPECT_THROW(ReadSet(folder / "absent.dtr"), Error);
  EXPECT_THROW(ReadSet(folder.path()), Error);
  WriteFileAtomically(folder / "file.dtr", "x");
  EXPECT_THROW(ReadSet(folder / "file.dtr"), Error);
}

TEST(ReadSet, RoundTripsEverythingExactly) {
  const TemporaryFolder folder;
  const DtrSet written = WriteSmallSet(folder / "small.dtr");
  const DtrSet read = ReadSet(folder / "small.dtr");
  EXPECT_EQ(read.unit, LengthUnit::kMetre);
  EXPECT_EQ(read.world_origin, written.world_origin);
  EXPECT_EQ(read.scene_center, written.scene_center);
  EXPECT_EQ(read.bounds.min, written.bounds.min);
  EXPECT_EQ(read.bounds.max, written.bounds.max);
  EXPECT_EQ(read.sparse_file, written.sparse_file);
  EXPECT_EQ(read.provenance_json, written.provenance_json);
  ASSERT_EQ(read.frames.size(), 1u);
  ASSERT_EQ(read.frames[0].views.size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    const View &a = written.frames[0].views[i], &b = read.frames[0].views[i];
    EXPECT_EQ(b.id, a.id);
    EXPECT_EQ(b.name, a.name);
    EXPECT_EQ(b.role, a.role);
    EXPECT_EQ(b.camera, a.camera);
    EXPECT_EQ(b.cam_from_world.rotation.coeffs(), a.cam_from_world.rotation.coeffs());
    EXPECT_EQ(b.cam_from_world.translation, a.cam_from_world.translation);
    EXPECT_EQ(b.depth_scale, a.depth_scale);
    EXPECT_EQ(b.near_z, a.near_z);
    EXPECT_EQ(b.far_z, a.far_z);
    EXPECT_EQ(b.reference_baseline, a.reference_baseline);
    EXPECT_EQ(b.gain, a.gain);
    EXPECT_EQ(b.image_file, a.image_file);
    EXPECT_EQ(b.mask_file, a.mask_file);
    EXPECT_EQ(b.depth_file, a.depth_file);
    EXPECT_EQ(b.sigma_file, a.sigma_file);
    EXPECT_TRUE(b.image.empty());
  }
}

TEST(LoadSet, BringsThePixelsBackAndLeavesHeldOutViewsOut) {
  const TemporaryFolder folder;
  const DtrSet written = WriteSmallSet(folder / "small.dtr");
  const DtrSet loaded = LoadSet(folder / "small.dtr", {.sigma = true});
  ASSERT_THAT(loaded.frames[0].views, SizeIs(2));
  for (size_t i = 0; i < 2; ++i) {
    const View &a = written.frames[0].views[i], &b = loaded.frames[0].views[i];
    EXPECT_EQ(b.image, a.image);
    EXPECT_EQ(b.mask, a.mask);
    EXPECT_EQ(b.inverse_depth_sigma, a.inverse_depth_sigma);
    EXPECT_EQ(b.depth,
              RoundToCoding(a.depth, {a.depth_coding, a.near_z, a.far_z, LengthUnit::kMetre}));
  }
  const DtrSet all = LoadSet(folder / "small.dtr", {.depth = false, .held_out = true});
  ASSERT_THAT(all.frames[0].views, SizeIs(3));
  EXPECT_EQ(all.frames[0].views[2].image, written.frames[0].views[2].image);
  EXPECT_TRUE(all.frames[0].views[0].depth.empty());
  EXPECT_THAT(LoadSparse(folder / "small.dtr", all).observations, SizeIs(2));
}

TEST(LoadSet, PixelsOfAnotherSizeAreRejected) {
  const TemporaryFolder folder;
  WriteSmallSet(folder / "small.dtr");
  DtrSet set = ReadSet(folder / "small.dtr");
  View& view = set.frames[0].views[0];
  WritePng16(folder / "small.dtr/depth/view0.png", Grid<std::uint16_t>(7, 6));
  EXPECT_THROW(LoadPixels(folder / "small.dtr", view, {.images = false}), Error);
  WriteImage(folder / "small.dtr/images/view0.png", ImageRgb8(8, 7, 3));
  EXPECT_THROW(LoadPixels(folder / "small.dtr", view, {.depth = false}), Error);
  WriteMask(folder / "small.dtr/mask/view1.png", Mask(9, 6));
  EXPECT_THROW(LoadPixels(folder / "small.dtr", set.frames[0].views[1], {.depth = false}), Error);
  WriteExr(folder / "small.dtr/sigma/view1.exr", Grid<float>(4, 4));
  EXPECT_THROW(LoadPixels(folder / "small.dtr", set.frames[0].views[1],
                          {.images = false, .depth = false, .sigma = true}),
               Error);
}

TEST(CollapseDuplicates, KeepsTheFirstOfEqualCamerasAndContents) {
  const TemporaryFolder folder;
  DtrSet set = EmptySet();
  set.frames[0].views = {SmallView(0), SmallView(0), SmallView(0), SmallView(1)};
  set.frames[0].views[1].id = "copy";
  set.frames[0].views[2].id = "other_pose";
  set.frames[0].views[2].cam_from_world.translation.x() += 1e-9;
  {
    SetWriter writer(folder / "twice.dtr", "{}", false);
    for (View& view : set.frames[0].views) writer.WriteView(view, set.unit);
    writer.Finish(set);
  }
  EXPECT_THAT(ReadSet(folder / "twice.dtr").frames[0].views, SizeIs(4));
  EXPECT_THAT(LoadSet(folder / "twice.dtr").frames[0].views, SizeIs(3));
  EXPECT_THAT(LoadSet(folder / "twice.dtr", {.collapse_duplicates = false}).frames[0].views,
              SizeIs(4));
  DtrSet again = ReadSet(folder / "twice.dtr");
  EXPECT_THAT(CollapseDuplicates(again), ElementsAre("copy"));
}

TEST(MakeViewIds, AreSafeAndUniqueAlsoWithoutCase) {
  const std::vector<std::string> names = {"a/IMG 1.JPG", "a/IMG_1.png", "A/img_1.jpg", "b.c.jpg",
                                          "Säule.jpg",   ".hidden",     "a_IMG_1_2.x"};
  EXPECT_THAT(MakeViewIds(names), ElementsAre("a_IMG_1", "a_IMG_1_2", "A_img_1_3", "b_c", "S__ule",
                                              "_hidden", "a_IMG_1_2_2"));
}

TEST(Info, NamesWhatMachinesRelyOn) {
  const TemporaryFolder folder;
  WriteSmallSet(folder / "small.dtr");
  const DtrSet set = ReadSet(folder / "small.dtr");
  const std::string json = InfoJson(set);
  for (const char* text : {"\"unit\": \"metre\"", "\"verdict\": {}", "\"role\": \"held_out\"",
                           "\"width_px\": 8", "\"height_px\": 6", "\"name\": \"photos/S"}) {
    EXPECT_THAT(json, HasSubstr(text));
  }
  EXPECT_THAT(DescribeSet(set), HasSubstr("2 source views, 1 held out"));
  EXPECT_THAT(DescribeSet(set), HasSubstr("not validated"));
}

}  // namespace
}  // namespace dtr::io
