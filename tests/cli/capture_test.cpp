// `dtr capture`, and what `dtr build` makes of masks and videos.
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>

#include "calib/colmap/model_io.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::HasSubstr;

TEST(CaptureCommand, ShowsWhatItTookAndDropsWhatItIsToldTo) {
  const TemporaryFolder folder;
  MakeSmallCourtyard(folder / "c");
  const fs::path photos = folder / "c/images";
  fs::copy_file(photos / "0000.jpg", photos / "again.jpg");
  const Ran kept =
      DtrOk({"capture", photos.string(), "-o", (folder / "all").string(), "--json", "-"});
  const Json all = Json::parse(kept.out);
  ASSERT_EQ(all["photos"].size(), static_cast<size_t>(kCourtyardViews) + 1);
  EXPECT_EQ(all["photos"].back()["name"], "again.jpg");
  EXPECT_EQ(all["photos"].back()["faults"], Json({"duplicate"}));
  EXPECT_THAT(kept.err, HasSubstr("again.jpg: has the same bytes as 0000.jpg"));
  EXPECT_THAT(Text(folder / "all/index.html"), HasSubstr("has the same bytes as 0000.jpg"));
  EXPECT_EQ(io::ReadImageHeader(folder / "all/contact_sheet.jpg").width_px, 3 * (192 + 4) + 4);

  const Ran fewer = DtrOk({"capture", photos.string(), "-o", (folder / "fewer").string(), "--drop",
                           "duplicate,blurred", "--json", "-"});
  const Json dropped = Json::parse(fewer.out);
  EXPECT_EQ(dropped["photos"].size(), static_cast<size_t>(kCourtyardViews));
  EXPECT_EQ(dropped["skipped"].at(0)["name"], "again.jpg");
  // A capture is a source of photos like any other.
  const Ran again = DtrOk(
      {"capture", (folder / "fewer").string(), "-o", (folder / "copy").string(), "--json", "-"});
  EXPECT_EQ(Json::parse(again.out)["photos"].size(), static_cast<size_t>(kCourtyardViews));

  ExpectRejected(Dtr({"capture", photos.string(), "-o", (folder / "x").string(), "--drop", "ugly"}),
                 2, "expected blurred, overexposed, underexposed or duplicate");
  ExpectRejected(Dtr({"capture", photos.string(), "-o", (folder / "all").string()}), 2,
                 "expected a new folder");
  EXPECT_FALSE(fs::exists(folder / "x"));
}

TEST(BuildCommand, WhatAMaskHidesIsInNoTexture) {
  const TemporaryFolder folder;
  MakeSmallCourtyard(folder / "c");
  Mask mask(kCourtyardWidthPx, kCourtyardHeightPx, 1, 255);
  for (int y = 20; y < 60; ++y) {
    for (int x = 40; x < 100; ++x) mask(x, y) = 0;
  }
  io::WriteMask(folder / "c/images/0001_mask.png", mask);
  const fs::path set = folder / "set.dtr";
  DtrOk({"build", (folder / "c/images").string(), "-o", set.string(), "--poses",
         (folder / "c/sparse").string(), "--engine", "none", "--max-size", "0"});
  DtrSet read = io::ReadSet(set);
  ASSERT_EQ(read.frames.front().views.size(), static_cast<size_t>(kCourtyardViews));
  View& view = read.frames.front().views[1];
  io::LoadPixels(set, view, {});
  EXPECT_EQ(view.mask, mask);
  EXPECT_EQ(view.image(70, 40, 1), 0);
  EXPECT_TRUE(read.frames.front().views[2].mask.empty());
}

// The photos of a small courtyard as a video, and their model under the names of its frames.
void MakeVideo(const fs::path& courtyard, const fs::path& video, const fs::path& model_folder) {
  calib::SfmModel model = colmap::ReadModel(courtyard / "sparse");
  cv::VideoWriter writer(video.string(), cv::CAP_OPENCV_MJPEG,
                         cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 10,
                         cv::Size(kCourtyardWidthPx, kCourtyardHeightPx));
  for (int i = 0; i < kCourtyardViews; ++i) {
    const ImageRgb8 photo = io::ReadImage(courtyard / "images" / fmt::format("{:04}.jpg", i));
    cv::Mat frame(photo.height(), photo.width(), CV_8UC3);
    for (int y = 0; y < photo.height(); ++y) {
      for (int x = 0; x < photo.width(); ++x) {
        frame.at<cv::Vec3b>(y, x) = {photo(x, y, 2), photo(x, y, 1), photo(x, y, 0)};
      }
    }
    writer.write(frame);
    for (calib::SfmImage& image : model.images) {
      if (image.name == fmt::format("{:04}.jpg", i)) image.name = fmt::format("frame_{:06}.jpg", i);
    }
  }
  colmap::WriteModel(model_folder, model, colmap::Format::kBinary);
}

TEST(BuildCommand, TakesAVideoForPhotos) {
  const TemporaryFolder folder;
  MakeSmallCourtyard(folder / "c");
  MakeVideo(folder / "c", folder / "walk.avi", folder / "model");
  const fs::path set = folder / "set.dtr";
  const std::vector<std::string> command{"build",     (folder / "walk.avi").string(),
                                         "-o",        set.string(),
                                         "--poses",   (folder / "model").string(),
                                         "--engine",  "none",
                                         "--every",   "1",
                                         "--holdout", "frame_000002.jpg"};
  DtrOk(command);
  const DtrSet read = io::ReadSet(set);
  const auto& views = read.frames.front().views;
  ASSERT_EQ(views.size(), static_cast<size_t>(kCourtyardViews));
  EXPECT_EQ(views[3].name, "frame_000003.jpg");
  EXPECT_EQ(views[2].role, ViewRole::kHeldOut);
  const Json provenance = Json::parse(read.provenance_json);
  EXPECT_EQ(provenance["photos"].at(3)["video"], "walk.avi");
  EXPECT_EQ(provenance["photos"].at(3)["frame"], 3);
  EXPECT_FALSE(fs::exists(set / "capture"));
  // The same command with other frames would be another set.
  std::vector<std::string> other = command;
  other[8] = "--motion";
  other[9] = "0.2";
  ExpectRejected(Dtr(other), 2, "expected no such folder yet");
}

// The natural call in a folder of videos, and options that are known to fail once frames are there.
TEST(BuildCommand, AFolderOfVideosMayHoldTheSet) {
  const TemporaryFolder folder;
  MakeSmallCourtyard(folder / "c");
  fs::create_directory(folder / "videos");
  MakeVideo(folder / "c", folder / "videos/walk.avi", folder / "model");
  const fs::path set = folder / "videos/set.dtr";
  std::vector<std::string> command{"build",     (folder / "videos").string(),
                                   "-o",        set.string(),
                                   "--poses",   (folder / "model").string(),
                                   "--engine",  "none",
                                   "--every",   "1",
                                   "--holdout", "nobody"};
  ExpectRejected(Dtr(command), 2, "--holdout: no photo is named 'nobody'");
  EXPECT_FALSE(fs::exists(set.string() + ".partial"));  // it would stand in the next one's way
  command.back() = "frame_000002.jpg";
  DtrOk(command);
  EXPECT_EQ(io::ReadSet(set).frames.front().views.size(), static_cast<size_t>(kCourtyardViews));
}

}  // namespace
}  // namespace dtr::testing
