#include "capture/ingest.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "capture/duplicates.h"
#include "capture/screening.h"
#include "capture/sfm_images.h"
#include "capture/store.h"
#include "dtr/base/error.h"
#include "dtr/base/random.h"
#include "tests/capture/photo_files.h"
#include "tests/support/on_threads.h"
#include "tests/support/test_data.h"

namespace dtr::capture {
namespace {

namespace fs = std::filesystem;
using dtr::testing::TemporaryFolder;
using testing::AddExifOrientation;
using testing::BlockPhoto;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::MessageOf;
using testing::NoisePhoto;

Capture Ingest(const fs::path& folder, int threads = 2) {
  SilentProgress progress;
  const ThreadLimit limit(threads);
  return IngestPhotos(folder, {}, progress);
}

std::vector<std::string> NamesOf(const Capture& capture) {
  std::vector<std::string> names;
  for (const Photo& photo : capture.photos) names.push_back(photo.name);
  return names;
}

TEST(IngestPhotos, TakesPhotosInByteOrderWithTheirOriginalNames) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "left/deep");
  fs::create_directories(folder / ".thumbnails");
  for (const char* name : {"b 2.png", "B1.JPG", "a.jpg", "épicerie.png", "left/10.png",
                           "left/9.png", "left/deep/1.jpeg", ".hidden.png", ".thumbnails/t.png"}) {
    // WriteImage takes its format from the extension in lower case or not.
    io::WriteImage(folder / name, NoisePhoto(16, 8, 1));
  }
  WriteFileAtomically(folder / "notes.txt", "not a photo, and does not say so");
  WriteFileAtomically(folder / "K", "1 0 0");
  const Capture capture = Ingest(folder.path());
  EXPECT_THAT(NamesOf(capture), ElementsAre("B1.JPG", "a.jpg", "b 2.png", "left/10.png",
                                            "left/9.png", "left/deep/1.jpeg", "épicerie.png"));
  EXPECT_THAT(capture.skipped, IsEmpty());
  EXPECT_EQ(capture.photos[3].file, folder / "left/10.png");
  SilentProgress progress;
  const Capture flat = IngestPhotos(folder.path(), {.recurse = false}, progress);
  EXPECT_THAT(NamesOf(flat), ElementsAre("B1.JPG", "a.jpg", "b 2.png", "épicerie.png"));
}

TEST(IngestPhotos, IdsAreUniqueAndSafeAsFileNames) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "left");
  for (const char* name : {"A.png", "a.jpg", "a.png", "left/1.png", "left_1.png", "-x.y z.png"}) {
    io::WriteImage(folder / name, NoisePhoto(16, 8, 1));
  }
  std::vector<std::string> ids;
  for (const Photo& photo : Ingest(folder.path()).photos) ids.push_back(photo.id);
  // Names in byte order: -x.y z.png, A.png, a.jpg, a.png, left/1.png, left_1.png.
  EXPECT_THAT(ids, ElementsAre("_-x_y_z", "A", "a-2", "a-3", "left_1", "left_1-2"));
}

TEST(IngestPhotos, NamesWhatItSkipsAndWhy) {
  const TemporaryFolder folder;
  io::WriteImage(folder / "good.jpg", NoisePhoto(64, 48, 1));
  io::WriteImage(folder / "cut.jpg", NoisePhoto(64, 48, 2));
  WriteFileAtomically(folder / "cut.jpg", ReadFile(folder / "cut.jpg", 1 << 20).substr(0, 2000));
  WriteFileAtomically(folder / "text.jpg", "I am no photo");
  WriteFileAtomically(folder / "empty.png", "");
  WriteFileAtomically(folder / "b\xff.png", "name is no UTF-8");
  fs::create_directories(folder / "is_a_folder.jpg");
  fs::create_directory_symlink(folder.path(), folder / "loop");
  // Of a calibration whose output lies among its photos.
  fs::create_directories(folder / "out/workspace/photos");
  WriteFileAtomically(folder / "out/workspace/calibration.lock", "");
  io::WriteImage(folder / "out/workspace/photos/good.jpg", NoisePhoto(64, 48, 1));
  const Capture capture = Ingest(folder.path());
  EXPECT_THAT(NamesOf(capture), ElementsAre("good.jpg"));
  std::vector<std::string> names;
  for (const Skipped& skipped : capture.skipped) {
    names.push_back(skipped.name);
    EXPECT_FALSE(skipped.reason.empty()) << skipped.name;
    EXPECT_THAT(skipped.reason, ::testing::Not(HasSubstr("\n")));
    EXPECT_THAT(skipped.reason, ::testing::Not(HasSubstr(folder.path().string())));
  }
  EXPECT_THAT(names, ElementsAre("b?.png", "cut.jpg", "empty.png", "loop", "text.jpg"));
  EXPECT_THAT(LineOf(capture.contents),
              HasSubstr("files of folders that dtr made (2: out/workspace/)"));
}

TEST(IngestPhotos, LinksToFoldersAreFollowedOnce) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "elsewhere/deeper");
  fs::create_directories(folder / "photos/own");
  io::WriteImage(folder / "elsewhere/a.jpg", NoisePhoto(64, 48, 1));
  io::WriteImage(folder / "elsewhere/deeper/b.jpg", NoisePhoto(64, 48, 2));
  io::WriteImage(folder / "photos/own/c.jpg", NoisePhoto(64, 48, 3));
  const auto link = [&](const fs::path& target, const std::string& name) {
    fs::create_directory_symlink(folder / target, folder / "photos" / name);
  };
  link("elsewhere", "linked");
  link("elsewhere", "twice");          // what "linked" leads to
  link("elsewhere/deeper", "deeper");  // comes before "linked", which holds it
  link("photos/own", "loop");          // read as it stands
  link("", "up");                      // holds all this
  fs::create_directory_symlink(folder / "photos", folder / "elsewhere/back");
  const Capture capture = Ingest(folder / "photos");
  EXPECT_THAT(NamesOf(capture), ElementsAre("deeper/b.jpg", "linked/a.jpg", "own/c.jpg"));
  std::vector<std::string> skipped;
  for (const Skipped& item : capture.skipped) skipped.push_back(item.name + ": " + item.reason);
  EXPECT_THAT(skipped, ElementsAre("linked/back: links to a folder that holds this one",
                                   "linked/deeper: is read already, by a link to it",
                                   "loop: links to a folder that is read already",
                                   "twice: links to a folder that is read already",
                                   "up: links to a folder that holds this one"));
}

TEST(IngestPhotos, FoldersWithoutPhotosAreCleanErrors) {
  const TemporaryFolder folder;
  EXPECT_THAT(MessageOf<UsageError>([&] { Ingest(folder / "absent"); }), HasSubstr("absent"));
  WriteFileAtomically(folder / "file", "");
  EXPECT_THAT(MessageOf<UsageError>([&] { Ingest(folder / "file"); }), HasSubstr("folder"));
  EXPECT_THAT(MessageOf<Error>([&] { Ingest(folder.path()); }), HasSubstr("found none"));
  WriteFileAtomically(folder / "text.jpg", "I am no photo");
  EXPECT_THAT(MessageOf<Error>([&] { Ingest(folder.path()); }), HasSubstr("text.jpg"));
}

TEST(RequireEnoughPhotos, OnePhotoIsNoScene) {
  const TemporaryFolder folder;
  io::WriteImage(folder / "a.png", NoisePhoto(16, 8, 1));
  const Capture one = Ingest(folder.path());
  EXPECT_THAT(MessageOf<Error>([&] { RequireEnoughPhotos(one, folder.path()); }),
              HasSubstr("at least 2 photos, found 1"));
  io::WriteImage(folder / "b.png", NoisePhoto(16, 8, 2));
  EXPECT_NO_THROW(RequireEnoughPhotos(Ingest(folder.path()), folder.path()));
}

TEST(IngestPhotos, TurnsPhotosUprightForEveryOrientation) {
  const TemporaryFolder folder;
  const ImageRgb8 stored = BlockPhoto(48, 32, 3);
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const fs::path file = folder / (std::to_string(orientation) + ".jpg");
    io::WriteImage(file, stored, 100);
    if (orientation > 1) AddExifOrientation(file, orientation);
  }
  const Capture capture = Ingest(folder.path());
  ASSERT_EQ(capture.photos.size(), 8u);
  const ImageRgb8 as_stored = ReadPhoto(capture.photos[0]);
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const Photo& photo = capture.photos[static_cast<size_t>(orientation - 1)];
    EXPECT_EQ(photo.exif_orientation, orientation);
    EXPECT_EQ(photo.width_px, orientation >= 5 ? 32 : 48);
    EXPECT_EQ(photo.height_px, orientation >= 5 ? 48 : 32);
    const ImageRgb8 upright = ReadPhoto(photo);
    // EXIF 2.3: where the stored first row and first column are seen.
    const auto corner = [&](int x, int y) { return upright(x, y, 0) * 256 + upright(x, y, 1); };
    const int w = photo.width_px - 1, h = photo.height_px - 1;
    const int expected_corner[8][2] = {{0, 0}, {w, 0}, {w, h}, {0, h},
                                       {0, 0}, {w, 0}, {w, h}, {0, h}};
    const int expected_next[8][2] = {{12, 0}, {w - 12, 0}, {w - 12, h}, {12, h},
                                     {0, 12}, {w, 12},     {w, h - 12}, {0, h - 12}};
    const auto& at = expected_corner[orientation - 1];
    const auto& next = expected_next[orientation - 1];
    EXPECT_EQ(corner(at[0], at[1]), as_stored(0, 0, 0) * 256 + as_stored(0, 0, 1)) << orientation;
    EXPECT_EQ(corner(next[0], next[1]), as_stored(12, 0, 0) * 256 + as_stored(12, 0, 1))
        << orientation;
  }
}

TEST(ReadPhoto, RejectsAFileThatChangedItsSize) {
  const TemporaryFolder folder;
  io::WriteImage(folder / "a.png", NoisePhoto(16, 8, 1));
  const Capture capture = Ingest(folder.path());
  io::WriteImage(folder / "a.png", NoisePhoto(16, 9, 1));
  EXPECT_THAT(MessageOf<Error>([&] { ReadPhoto(capture.photos[0]); }), HasSubstr("16x9"));
}

TEST(FocalFromExif, FollowsTheDiagonalOfThirtyFiveMillimetreFilm) {
  io::ImageHeader header;
  header.width_px = 3600;
  header.height_px = 2400;
  EXPECT_FALSE(FocalFromExif(header).focal_px);
  EXPECT_EQ(FocalFromExif(header).source, "none");
  header.focal_35mm = 50;  // a 36x24 image: 100 pixels per millimetre
  EXPECT_NEAR(*FocalFromExif(header).focal_px, 5000, 1e-9);
  EXPECT_EQ(FocalFromExif(header).source, "exif-35mm");
  std::swap(header.width_px, header.height_px);
  EXPECT_NEAR(*FocalFromExif(header).focal_px, 5000, 1e-9);
  header.focal_35mm = {};
  header.focal_mm = 18;
  EXPECT_FALSE(FocalFromExif(header).focal_px);  // of an unknown sensor
  header.focal_plane_px_per_mm = 250;
  EXPECT_NEAR(*FocalFromExif(header).focal_px, 4500, 1e-9);
  EXPECT_EQ(FocalFromExif(header).source, "exif-focal-plane");
  header.focal_plane_px_per_mm = 1e6;  // 18 km of focal length in pixels: a broken tag
  EXPECT_FALSE(FocalFromExif(header).focal_px);
}

TEST(IngestPhotos, PhotosOfOneLensShareAGroup) {
  const TemporaryFolder folder;
  const io::ExifFocal canon{35.0, 50.0, "Canon", "EOS"}, zoomed{70.0, 100.0, "Canon", "EOS"};
  io::WriteJpegWithExif(folder / "a.jpg", BlockPhoto(48, 32, 1), 90, canon);
  io::WriteJpegWithExif(folder / "b.jpg", BlockPhoto(48, 32, 2), 90, canon);
  io::WriteJpegWithExif(folder / "c.jpg", BlockPhoto(48, 32, 3), 90, zoomed);
  io::WriteJpegWithExif(folder / "d.jpg", BlockPhoto(32, 48, 4), 90, canon);
  io::WriteImage(folder / "e.png", BlockPhoto(48, 32, 5));
  io::WriteImage(folder / "f.png", BlockPhoto(48, 32, 6));
  io::WriteImage(folder / "g.jpg", BlockPhoto(48, 32, 7));
  AddExifOrientation(folder / "g.jpg", 3);
  const auto photos = Ingest(folder.path()).photos;
  ASSERT_EQ(photos.size(), 7u);
  EXPECT_EQ(photos[0].camera_group, "Canon|EOS|48x32|35.00mm");
  EXPECT_EQ(photos[0].camera_group, photos[1].camera_group);
  EXPECT_EQ(photos[4].camera_group, photos[5].camera_group);
  for (const size_t other : {2u, 3u, 4u, 6u}) {
    EXPECT_NE(photos[0].camera_group, photos[other].camera_group);
  }
  EXPECT_NE(photos[4].camera_group, photos[6].camera_group);  // turned
  ASSERT_TRUE(photos[0].focal_prior_px);
  EXPECT_NEAR(*photos[0].focal_prior_px, 50.0 * 48 / 36, 1e-3);
  EXPECT_FALSE(photos[4].focal_prior_px);
}

TEST(IngestPhotos, SceauxHasItsCamerasFocalLengthWithinThreePercent) {
  const fs::path folder = dtr::testing::DataFolder() / "sceaux_castle/images";
  DTR_REQUIRE_DATA(folder);
  SilentProgress progress;
  const Capture capture = IngestPhotos(folder, {.screen = false}, progress);
  EXPECT_EQ(capture.photos.size(), 11u);
  EXPECT_THAT(capture.skipped, IsEmpty());
  for (const Photo& photo : capture.photos) {
    ASSERT_TRUE(photo.focal_prior_px);
    EXPECT_NEAR(*photo.focal_prior_px / 2905.88, 1, 0.03);  // K.txt beside the photos
    EXPECT_EQ(photo.camera_group, capture.photos[0].camera_group);
  }
}

TEST(Screening, DuplicatesBlurAndClippingAreRemarkedAndNothingIsDropped) {
  const TemporaryFolder folder;
  for (int i = 0; i < 4; ++i) {
    io::WriteImage(folder / ("sharp" + std::to_string(i) + ".png"), NoisePhoto(64, 48, 10 + i));
  }
  fs::copy_file(folder / "sharp1.png", folder / "z_copy.png");
  ImageRgb8 blurred(64, 48, 3), bright(64, 48, 3, 255);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      for (int c = 0; c < 3; ++c) {
        blurred(x, y, c) =
            static_cast<std::uint8_t>(127 + 100 * std::sin(x * 0.1) * std::cos(y * 0.1));
      }
    }
  }
  for (int x = 0; x < 64; ++x) bright(x, 5, 1) = bright(x, 5, 0) = bright(x, 5, 2) = 100;
  io::WriteImage(folder / "blurred.png", blurred);
  io::WriteImage(folder / "bright.png", bright);
  const Capture capture = Ingest(folder.path());
  ASSERT_EQ(capture.photos.size(), 7u);  // blurred, bright, sharp0..3, z_copy
  const auto& blurred_screening = *capture.photos[0].screening;
  ASSERT_EQ(blurred_screening.remarks.size(), 1u);
  EXPECT_THAT(blurred_screening.remarks[0], HasSubstr("blurred"));
  EXPECT_NEAR(capture.photos[1].screening->overexposed_share, 47.0 / 48, 1e-12);
  EXPECT_THAT(capture.photos[1].screening->remarks.back(), HasSubstr("overexposed"));
  EXPECT_THAT(capture.photos[2].screening->remarks, IsEmpty());
  EXPECT_EQ(capture.photos[6].screening->duplicate_of, "sharp1.png");
}

// A photo of soft blobs, seen from `shift` pixels further right, with noise of that many levels.
ImageRgb8 Blobs(double shift_px, int noise, std::uint64_t seed) {
  Random random(seed);
  ImageRgb8 image(400, 300, 3);
  for (int y = 0; y < 300; ++y) {
    for (int x = 0; x < 400; ++x) {
      const double value = 120 + 60 * std::sin((x + shift_px) / 9) * std::cos(y / 7.0);
      const int grain = noise > 0 ? static_cast<int>(random.Index(2 * noise + 1)) - noise : 0;
      for (int c = 0; c < 3; ++c) image(x, y, c) = static_cast<std::uint8_t>(value + grain);
    }
  }
  return image;
}

TEST(ScreenPhotos, ShotsOfOnePictureAreDuplicatesAndASmallStepIsNone) {
  const TemporaryFolder folder;
  io::WriteImage(folder / "a.png", Blobs(0, 3, 1));
  io::WriteImage(folder / "b.png", Blobs(0, 3, 2));  // from the same tripod
  io::WriteImage(folder / "c.png", Blobs(2, 3, 3));  // half a per cent of the image further
  io::WriteImage(folder / "d.png", Blobs(2, 3, 4));
  const Capture capture = Ingest(folder.path());
  ASSERT_EQ(capture.photos.size(), 4u);
  EXPECT_THAT(capture.photos[0].screening->faults, IsEmpty());
  EXPECT_THAT(capture.photos[1].screening->faults, ElementsAre(Fault::kDuplicate));
  EXPECT_EQ(capture.photos[1].screening->duplicate_of, "a.png");
  EXPECT_THAT(capture.photos[1].screening->remarks[0], HasSubstr("same image as a.png"));
  EXPECT_EQ(capture.photos[2].screening->duplicate_of, "");
  EXPECT_EQ(capture.photos[3].screening->duplicate_of, "c.png");
}

TEST(DropSameImages, TakesOutWhatHasTheSamePixelsAndKeepsWhatResembles) {
  const TemporaryFolder folder;
  const auto none = [](const std::string&) { return false; };
  io::WriteImage(folder / "a.png", Blobs(0, 3, 1));
  io::WriteImage(folder / "b.jpg", Blobs(0, 3, 2));  // another shot from the same tripod
  fs::copy_file(folder / "b.jpg", folder / "c.jpg");
  AddExifOrientation(folder / "c.jpg", 1);            // the pixels of b in another file
  io::WriteImage(folder / "d.png", Blobs(20, 3, 3));  // from elsewhere
  fs::copy_file(folder / "a.png", folder / "e.png");
  Capture capture = Ingest(folder.path());
  ASSERT_EQ(capture.photos.size(), 5u);
  const auto left_out = DropSameImages(capture, none);
  EXPECT_THAT(NamesOf(capture), ElementsAre("a.png", "b.jpg", "d.png"));
  ASSERT_EQ(left_out.size(), 2u);
  EXPECT_EQ(left_out[0].name + " " + left_out[0].same_as, "c.jpg b.jpg");
  EXPECT_EQ(left_out[1].name + " " + left_out[1].same_as, "e.png a.png");
  ASSERT_EQ(capture.skipped.size(), 2u);
  EXPECT_EQ(capture.skipped[1].name, "e.png");
  EXPECT_THAT(capture.skipped[1].reason, HasSubstr("same pixels as a.png"));
  EXPECT_THAT(DropSameImages(capture, none), IsEmpty());
}

TEST(DropSameImages, MasksAndPreferenceHaveASay) {
  const TemporaryFolder folder;
  for (const char* name : {"a.png", "b.png", "c.png"}) {
    io::WriteImage(folder / name, Blobs(0, 3, 1));
  }
  ImageRgb8 left_half(400, 300, 3);
  for (int y = 0; y < 300; ++y) {
    for (int x = 0; x < 600; ++x) left_half.row(y)[x] = 255;
  }
  io::WriteImage(folder / "a_mask.png", left_half);
  Capture capture = Ingest(folder.path());
  ASSERT_EQ(capture.photos.size(), 3u);
  // a shows less than b and c do; c is asked for.
  const auto left_out = DropSameImages(capture, [](const auto& name) { return name == "c.png"; });
  EXPECT_THAT(NamesOf(capture), ElementsAre("a.png", "c.png"));
  ASSERT_EQ(left_out.size(), 1u);
  EXPECT_EQ(left_out[0].name + " " + left_out[0].same_as, "b.png c.png");
}

TEST(DropFaulty, TakesOutWhatIsAskedForAndListsIt) {
  const TemporaryFolder folder;
  io::WriteImage(folder / "a.png", Blobs(0, 3, 1));
  io::WriteImage(folder / "b.png", Blobs(0, 3, 2));
  io::WriteImage(folder / "white.png", ImageRgb8(400, 300, 3, 255));
  Capture capture = Ingest(folder.path());
  DropFaulty(capture, {});
  EXPECT_EQ(capture.photos.size(), 3u);
  DropFaulty(capture, {Fault::kOverexposed, Fault::kDuplicate});
  EXPECT_THAT(NamesOf(capture), ElementsAre("a.png"));
  ASSERT_EQ(capture.skipped.size(), 2u);
  EXPECT_EQ(capture.skipped[0].name, "b.png");
  EXPECT_THAT(capture.skipped[1].reason, HasSubstr("dropped: 100 % of it is overexposed"));
}

TEST(DropFaulty, TheSharpRetakeOfABlurredPhotoStays) {
  Capture capture;
  capture.photos.resize(3);
  const std::vector<std::string> names{"blurred.jpg", "retake.jpg", "third.jpg"};
  for (size_t i = 0; i < names.size(); ++i) {
    capture.photos[i].name = names[i];
    capture.photos[i].screening.emplace();
  }
  capture.photos[0].screening->faults = {Fault::kBlurred};
  capture.photos[0].screening->remarks = {"is blurred"};
  for (size_t i : {1, 2}) {
    capture.photos[i].screening->duplicate_of = "blurred.jpg";
    capture.photos[i].screening->faults = {Fault::kDuplicate};
    capture.photos[i].screening->remarks = {"shows the same image as blurred.jpg"};
  }
  Capture duplicates_alone = capture;
  DropFaulty(capture, {Fault::kBlurred, Fault::kDuplicate});
  EXPECT_THAT(NamesOf(capture), ElementsAre("retake.jpg"));
  Capture both_blurred = duplicates_alone;
  DropFaulty(duplicates_alone, {Fault::kDuplicate});
  EXPECT_THAT(NamesOf(duplicates_alone), ElementsAre("blurred.jpg"));
  // A retake that is blurred, too, stands for nothing; a copy of a copy is one of what stays.
  both_blurred.photos[1].screening->faults.push_back(Fault::kBlurred);
  both_blurred.photos[1].screening->remarks.push_back("is blurred");
  Capture chain = both_blurred;
  DropFaulty(both_blurred, {Fault::kBlurred, Fault::kDuplicate});
  EXPECT_THAT(NamesOf(both_blurred), ElementsAre("third.jpg"));
  chain.photos[2].screening->duplicate_of = "retake.jpg";
  DropFaulty(chain, {Fault::kDuplicate});
  EXPECT_THAT(NamesOf(chain), ElementsAre("blurred.jpg"));
}

TEST(IngestPhotos, NamesThatNoModelCanHoldAreSkippedBeforeAnyWork) {
  const TemporaryFolder folder;
  io::WriteImage(folder / " a.png", Blobs(0, 3, 1));
  io::WriteImage(folder / "b.png", Blobs(0, 3, 2));
  fs::create_directory(folder / "sub");
  io::WriteImage(folder / "sub/ c.png", Blobs(0, 3, 3));
  const Capture capture = Ingest(folder.path());
  EXPECT_THAT(NamesOf(capture), ElementsAre("b.png", "sub/ c.png"));
  ASSERT_EQ(capture.skipped.size(), 1u);
  EXPECT_THAT(capture.skipped[0].reason, HasSubstr("its name begins with a blank"));
}

TEST(IngestPhotos, AMaskBesideAPhotoIsItsMaskAndNoPhoto) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "left");
  Mask mask(64, 48, 1, 255);
  for (int x = 0; x < 20; ++x) mask(x, 7) = 0;
  io::WriteImage(folder / "a.jpg", NoisePhoto(64, 48, 1));
  io::WriteMask(folder / "a_mask.png", mask);
  io::WriteImage(folder / "b.jpg", NoisePhoto(64, 48, 2));
  fs::copy_file(folder / "a_mask.png", folder / "a_mask.tif");
  io::WriteMask(folder / "left/b_mask.png", mask);  // of no photo there: a photo
  io::WriteImage(folder / "c.jpg", NoisePhoto(64, 48, 3));
  io::WriteMask(folder / "c_mask.png", Mask(32, 24, 1, 255));
  io::WriteImage(folder / "d.jpg", NoisePhoto(64, 48, 4));
  io::WriteMask(folder / "d_mask.png", Mask(64, 48, 1, 0));
  const Capture capture = Ingest(folder.path());
  EXPECT_THAT(NamesOf(capture), ElementsAre("a.jpg", "b.jpg", "left/b_mask.png"));
  EXPECT_EQ(ReadPhotoMask(capture.photos[0]), mask);
  EXPECT_TRUE(ReadPhotoMask(capture.photos[1]).empty());
  ASSERT_EQ(capture.skipped.size(), 3u);
  EXPECT_EQ(capture.skipped[0].name, "a_mask.tif");
  EXPECT_THAT(capture.skipped[0].reason, HasSubstr("a second mask of a.jpg"));
  EXPECT_THAT(capture.skipped[1].reason, HasSubstr("expected a mask of 64x48 pixels"));
  EXPECT_THAT(capture.skipped[1].reason, HasSubstr("found 32x24"));
  EXPECT_THAT(capture.skipped[2].reason, HasSubstr("dark throughout"));
  // A capture keeps it, and SfM gets it of the size that the photo has there.
  WriteCapture(capture, folder / "capture");
  const Capture read = ReadCapture(folder / "capture");
  EXPECT_EQ(ReadPhotoMask(read.photos[0]), mask);
  EXPECT_EQ(read.photos[0].mask_sha256, capture.photos[0].mask_sha256);
  PrepareSfmImages(read, folder / "sfm", 32);
  const Mask small = io::ReadMask(SfmMaskFile(folder / "sfm", read.photos[0]));
  EXPECT_EQ(small.width(), 32);
  EXPECT_EQ(small(5, 3), 0);
  EXPECT_EQ(small(15, 3), 255);
  EXPECT_FALSE(fs::exists(SfmMaskFile(folder / "sfm", read.photos[1])));
}

TEST(MeasurePhoto, SharpnessIgnoresContrastAndFallsWithBlur) {
  const ImageRgb8 noise = NoisePhoto(200, 200, 4);
  ImageRgb8 faint = noise, soft = noise;
  for (auto& value : faint.data()) value = static_cast<std::uint8_t>(100 + value / 4);
  for (int y = 0; y < 200; ++y) {
    for (int x = 1; x < 199; ++x) {
      for (int c = 0; c < 3; ++c) {
        soft(x, y, c) = static_cast<std::uint8_t>(
            (noise(x - 1, y, c) + 2 * noise(x, y, c) + noise(x + 1, y, c)) / 4);
      }
    }
  }
  // White noise: the Laplacian's variance is 4^2 + 4 = 20 times the noise's.
  EXPECT_NEAR(MeasurePhoto(noise).sharpness, 20, 0.5);
  EXPECT_NEAR(MeasurePhoto(faint).sharpness, MeasurePhoto(noise).sharpness, 0.2);
  EXPECT_LT(MeasurePhoto(soft).sharpness, 0.8 * MeasurePhoto(noise).sharpness);
  EXPECT_EQ(MeasurePhoto(ImageRgb8(50, 50, 3, 90)).sharpness, 0);
  EXPECT_EQ(MeasurePhoto(ImageRgb8(2, 2, 3, 0)).underexposed_share, 1);
}

TEST(IngestPhotos, SameResultForAnyNumberOfThreads) {
  const TemporaryFolder folder;
  for (int i = 0; i < 9; ++i) {
    io::WriteImage(folder / (std::to_string(i) + ".png"), NoisePhoto(32, 24, i / 2));
  }
  WriteFileAtomically(folder / "5.png", "broken");
  const Capture one = Ingest(folder.path(), 1), four = Ingest(folder.path(), 4);
  EXPECT_EQ(NamesOf(one), NamesOf(four));
  for (size_t i = 0; i < one.photos.size(); ++i) {
    EXPECT_EQ(one.photos[i].id, four.photos[i].id);
    EXPECT_EQ(one.photos[i].screening->sharpness, four.photos[i].screening->sharpness);
    EXPECT_EQ(one.photos[i].screening->remarks, four.photos[i].screening->remarks);
  }
}

TEST(IsImageExtension, KnowsPhotosAndLeavesFilmsAlone) {
  for (const char* yes : {".jpg", "JPEG", ".png", ".TIFF", ".exr", ".webp", ".ppm", ".cr2"}) {
    EXPECT_TRUE(IsImageExtension(yes)) << yes;
  }
  for (const char* no : {"", ".", ".txt", ".mp4", ".mov", ".json", ".vdb", ".npy"}) {
    EXPECT_FALSE(IsImageExtension(no)) << no;
  }
}

}  // namespace
}  // namespace dtr::capture
