#include "pipeline/core/photos/camera_groups.h"

#include "pipeline/core/cameras/exif_focal.h"

#include <gtest/gtest.h>

#include <set>

namespace dtr::pipeline {
namespace {

capture::Photo PhotoOf(const std::string& name, const std::string& group = "unknown",
                       int width_px = 640) {
  capture::Photo photo;
  photo.name = name;
  photo.camera_group = group;
  photo.width_px = width_px;
  photo.height_px = 480;
  return photo;
}

std::vector<capture::Photo> TwoFolders() {
  std::vector<capture::Photo> photos;
  for (const char* folder : {"left", "right"}) {
    for (const char* name : {"/1.jpg", "/2.jpg", "/3.jpg"}) {
      photos.push_back(PhotoOf(std::string(folder) + name));
    }
  }
  return photos;
}

size_t Cameras(const std::vector<capture::Photo>& photos, CameraPer per, bool given = false) {
  const CameraGroups groups(photos, per, given);
  std::set<std::string> names;
  for (const capture::Photo& photo : photos) names.insert(groups.GroupOf(photo));
  return names.size();
}

TEST(CameraGroups, EachWayToShareGivesItsNumberOfCameras) {
  EXPECT_EQ(Cameras(TwoFolders(), CameraPer::kAuto), 2u);  // tested after structure from motion
  EXPECT_EQ(Cameras(TwoFolders(), CameraPer::kFolder), 2u);
  EXPECT_EQ(Cameras(TwoFolders(), CameraPer::kPhoto), 6u);
  EXPECT_EQ(Cameras(TwoFolders(), CameraPer::kSet), 1u);
  EXPECT_EQ(Cameras(TwoFolders(), CameraPer::kAuto, true), 1u);  // a rig, a known camera
}

TEST(CameraGroups, ExifSeparatesCamerasOfOneFolderUnlessAskedOtherwise) {
  auto photos = TwoFolders();
  for (size_t i = 0; i < 3; ++i) photos.push_back(PhotoOf("left/z" + std::to_string(i), "zoomed"));
  EXPECT_EQ(Cameras(photos, CameraPer::kAuto), 3u);
  EXPECT_EQ(Cameras(photos, CameraPer::kFolder), 2u);
  EXPECT_EQ(Cameras(photos, CameraPer::kSet), 1u);
  EXPECT_EQ(CameraGroups(photos, CameraPer::kAuto, false).pools().size(), 1u);
}

TEST(CameraGroups, TurnedPhotosNeverShareWithOthers) {
  auto photos = TwoFolders();
  photos.push_back(PhotoOf("left/4.jpg", std::string("unknown") + capture::kTurnedGroup + "6"));
  EXPECT_EQ(Cameras(photos, CameraPer::kSet), 2u);
  EXPECT_EQ(Cameras(photos, CameraPer::kFolder), 3u);
}

TEST(CameraGroups, AFolderOfTwoPhotosSharesWithTheLargest) {
  auto photos = TwoFolders();
  photos.push_back(PhotoOf("few/1.jpg"));
  photos.push_back(PhotoOf("right/4.jpg"));
  const CameraGroups groups(photos, CameraPer::kAuto, false);
  ASSERT_EQ(groups.pools().size(), 1u);
  EXPECT_EQ(groups.pools()[0].largest, "right");
  EXPECT_EQ(groups.pools()[0].small, std::vector<std::string>{"few"});
  EXPECT_EQ(groups.GroupOf(photos[6]), groups.GroupOf(photos[7]));
  EXPECT_EQ(groups.GroupOf(PhotoOf("new/1.jpg")), groups.GroupOf(photos[7])) << "held out";
}

TEST(CameraGroups, OneFolderOrOneCameraPerFolderBySizeIsNoQuestion) {
  EXPECT_TRUE(
      CameraGroups({PhotoOf("a.jpg"), PhotoOf("b.jpg"), PhotoOf("c.jpg")}, CameraPer::kAuto, false)
          .pools()
          .empty());
  auto photos = TwoFolders();
  for (size_t i = 3; i < 6; ++i) photos[i].width_px = 800;
  EXPECT_TRUE(CameraGroups(photos, CameraPer::kAuto, false).pools().empty());
}

calib::SfmModel ModelWithFocal(double focal_px) {
  calib::SfmModel model;
  model.cameras[4] = {calib::CameraModel::kSimpleRadial, 800, 600, {focal_px, 400, 300, 0}};
  for (const char* name : {"a.jpg", "b.jpg", "c.jpg"}) {
    calib::SfmImage image;
    image.name = name;
    image.camera_id = 4;
    model.images.push_back(image);
  }
  return model;
}

TEST(ExifFocal, OnlyWhatRoundingCannotExplainContradictsIt) {
  const std::vector<sfm::SfmImageInput> photos{
      {"a.jpg", 800, 600, 889.0}, {"b.jpg", 800, 600, 889.0}, {"c.jpg", 800, 600, {}}};
  EXPECT_FALSE(ContradictsExif(ModelWithFocal(900), photos));
  EXPECT_FALSE(ContradictsExif(ModelWithFocal(1000), photos));
  EXPECT_FALSE(ContradictsExif(ModelWithFocal(800), photos));
  ASSERT_TRUE(ContradictsExif(ModelWithFocal(157), photos));
  EXPECT_EQ(ContradictsExif(ModelWithFocal(157), photos)->exif_px, 889);
  EXPECT_EQ(ContradictsExif(ModelWithFocal(157), photos)->found_px, 157);
  EXPECT_TRUE(ContradictsExif(ModelWithFocal(1800), photos));
  EXPECT_FALSE(ContradictsExif(ModelWithFocal(157), {{"a.jpg", 800, 600, {}}})) << "no EXIF";
}

}  // namespace
}  // namespace dtr::pipeline
