#include "capture/video/ingest_video.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/store.h"
#include "capture/video/frames.h"
#include "dtr/base/error.h"
#include "tests/capture/photo_files.h"
#include "tests/capture/video/moving_image.h"
#include "tests/support/on_threads.h"
#include "tests/support/test_data.h"

namespace dtr::capture {
namespace {

namespace fs = std::filesystem;
using dtr::testing::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::MessageOf;
using testing::WriteVideo;

std::vector<double> Places(int count, double step_px) {
  std::vector<double> places;
  for (int i = 0; i < count; ++i) places.push_back(step_px * i);
  return places;
}

Capture Ingest(const std::vector<fs::path>& videos, const VideoOptions& options,
               const fs::path& folder) {
  SilentProgress progress;
  fs::create_directories(folder);
  return IngestVideos(videos, options, folder, progress);
}

std::vector<std::string> NamesOf(const Capture& capture) {
  std::vector<std::string> names;
  for (const Photo& photo : capture.photos) names.push_back(photo.name);
  return names;
}

TEST(IngestVideos, TakesEveryNthFrameAndSaysWhichItIs) {
  const TemporaryFolder folder;
  WriteVideo(folder / "walk.avi", Places(25, 4));
  const Capture capture = Ingest({folder / "walk.avi"}, {.every = 10}, folder / "frames");
  ASSERT_THAT(NamesOf(capture),
              ElementsAre("frame_000000.jpg", "frame_000010.jpg", "frame_000020.jpg"));
  const Photo& second = capture.photos[1];
  ASSERT_TRUE(second.video_frame);
  EXPECT_EQ(second.video_frame->video, "walk.avi");
  EXPECT_EQ(second.video_frame->number, 10);
  EXPECT_NEAR(second.video_frame->time_s, 0.4, 0.041);  // FFmpeg may count from the frame's end
  EXPECT_EQ(second.camera_group, capture.photos[2].camera_group);
  EXPECT_THAT(capture.skipped, IsEmpty());
  // The image is that of the frame: 40 px further than the first.
  const ImageRgb8 first_picture = ReadPhoto(capture.photos[0]), picture = ReadPhoto(second);
  double difference = 0;
  for (int x = 0; x < 200; ++x) {
    difference += std::abs(picture(x, 90) - first_picture(x + 40, 90));
  }
  EXPECT_LT(difference / 200, 4);  // what Motion JPEG and JPEG lose
  // A capture keeps it.
  WriteCapture(capture, folder / "capture");
  const Capture read = ReadCapture(folder / "capture");
  ASSERT_TRUE(read.photos[1].video_frame);
  EXPECT_EQ(read.photos[1].video_frame->number, 10);
  EXPECT_EQ(read.photos[1].video_frame->video, "walk.avi");
}

TEST(IngestVideos, FramesArePhotosWhateverTheVideosAreCalled) {
  const TemporaryFolder folder;
  std::vector<fs::path> videos;
  for (const char* name : {"color.avi", "labels.avi", "normal.avi", "preview.avi"}) {
    WriteVideo(folder / name, Places(3, 4));
    videos.push_back(folder / name);
  }
  EXPECT_THAT(NamesOf(Ingest(videos, {.every = 3}, folder / "frames")),
              ElementsAre("color/frame_000000.jpg", "labels/frame_000000.jpg",
                          "normal/frame_000000.jpg", "preview/frame_000000.jpg"));
}

TEST(IngestVideos, ChoosesByMotionTheSameFramesForAnyNumberOfThreads) {
  const TemporaryFolder folder;
  WriteVideo(folder / "walk.avi", Places(40, 4));
  const Capture one =
      OnThreads(1, [&] { return Ingest({folder / "walk.avi"}, {}, folder / "one"); });
  const Capture two =
      OnThreads(2, [&] { return Ingest({folder / "walk.avi"}, {}, folder / "two"); });
  EXPECT_GE(one.photos.size(), 6u);  // 160 px of way, 0.06 of 320 px between two
  EXPECT_LE(one.photos.size(), 12u);
  ASSERT_EQ(NamesOf(one), NamesOf(two));
  for (size_t i = 0; i < one.photos.size(); ++i) {
    EXPECT_EQ(one.photos[i].source_sha256, two.photos[i].source_sha256);
  }
  const Capture few = Ingest({folder / "walk.avi"}, {.most = 3}, folder / "few");
  EXPECT_EQ(few.photos.size(), 3u);
}

TEST(IngestVideos, SynchronisedVideosGiveTheSameFramesUpToTheShortest) {
  const TemporaryFolder folder;
  WriteVideo(folder / "left.avi", Places(40, 4));
  WriteVideo(folder / "right.avi", Places(30, 4));
  const Capture capture = Ingest({folder / "left.avi", folder / "right.avi"},
                                 {.every = 15, .synchronised = true}, folder / "frames");
  EXPECT_THAT(NamesOf(capture), ElementsAre("left/frame_000000.jpg", "left/frame_000015.jpg",
                                            "right/frame_000000.jpg", "right/frame_000015.jpg"));
  EXPECT_NE(capture.photos[0].camera_group, capture.photos[2].camera_group);
  ASSERT_EQ(capture.skipped.size(), 1u);
  EXPECT_EQ(capture.skipped[0].name, "left.avi");
  EXPECT_THAT(capture.skipped[0].reason, HasSubstr("frames from 30 on"));
}

TEST(IngestVideos, VideosOfOneNameDoNotMix) {
  const TemporaryFolder folder;
  WriteVideo(folder / "walk.avi", Places(3, 4));
  fs::copy_file(folder / "walk.avi", folder / "walk.mkv");
  EXPECT_THAT(
      NamesOf(Ingest({folder / "walk.avi", folder / "walk.mkv"}, {.every = 3}, folder / "frames")),
      ElementsAre("walk.avi/frame_000000.jpg", "walk.mkv/frame_000000.jpg"));
}

TEST(IngestVideos, NamesThatMeetEachOtherOrAreNoFoldersOfPhotosKeepTheirExtension) {
  const TemporaryFolder folder;
  WriteVideo(folder / "w.avi", Places(3, 4));
  std::vector<fs::path> videos;
  for (const char* name : {"a.dtr.avi", "b.partial.avi", "c.avi", "w.avi", "w.avi.mkv", "w.mkv"}) {
    if (name != std::string("w.avi")) fs::copy_file(folder / "w.avi", folder / name);
    videos.push_back(folder / name);
  }
  EXPECT_THAT(NamesOf(Ingest(videos, {.every = 3}, folder / "frames")),
              ElementsAre("a.dtr.avi/frame_000000.jpg", "b.partial.avi/frame_000000.jpg",
                          "c/frame_000000.jpg", "w.avi.mkv/frame_000000.jpg",
                          "w.avi/frame_000000.jpg", "w.mkv/frame_000000.jpg"));
}

TEST(IngestVideos, RejectsVideosOfDifferentRatesAsOneRig) {
  const TemporaryFolder folder;
  WriteVideo(folder / "left.avi", Places(5, 4), 25);
  WriteVideo(folder / "right.avi", Places(5, 4), 30);
  const std::string message = MessageOf<Error>([&] {
    Ingest({folder / "left.avi", folder / "right.avi"}, {.synchronised = true}, folder / "frames");
  });
  EXPECT_THAT(message, HasSubstr("right.avi: expected 25.000 frames per second"));
  EXPECT_THAT(message, HasSubstr("found 30.000"));
}

TEST(IngestVideos, SaysWhatIsNoVideoAndWhatHasNothingToSee) {
  const TemporaryFolder folder;
  WriteFileAtomically(folder / "text.mp4", "I am no video");
  EXPECT_THAT(MessageOf<Error>([&] { Ingest({folder / "text.mp4"}, {}, folder / "a"); }),
              HasSubstr("text.mp4: expected a video, found something else by its first bytes"));
  // A playlist would have FFmpeg read whatever it names.
  WriteVideo(folder / "walk.avi", Places(3, 4));
  WriteFileAtomically(folder / "list.mp4",
                      "#EXTM3U\n#EXTINF:1,\n" + (folder / "walk.avi").string() + "\n");
  EXPECT_THAT(MessageOf<Error>([&] { Ingest({folder / "list.mp4"}, {}, folder / "d"); }),
              HasSubstr("playlists are not followed, give the video itself"));
  // What stands before a colon is no protocol.
  const fs::path here = fs::current_path();
  fs::current_path(folder.path());
  fs::rename("walk.avi", "file:walk.avi");
  EXPECT_EQ(Ingest({"file:walk.avi"}, {.every = 3}, folder / "e").photos.size(), 1u);
  fs::current_path(here);
  EXPECT_THAT(MessageOf<Error>([&] { Ingest({folder / "none.mp4"}, {}, folder / "b"); }),
              HasSubstr("no such file"));
  EXPECT_THAT(
      MessageOf<UsageError>([&] { Ingest({folder / "x.mp4"}, {.motion = 0}, folder / "c"); }),
      HasSubstr("`motion`"));
}

TEST(IngestVideos, FramesWithoutTextureAreRejected) {
  const TemporaryFolder folder;
  const fs::path file = folder / "fog.avi";
  {
    cv::VideoWriter video(file.string(), cv::CAP_OPENCV_MJPEG,
                          cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 25, cv::Size(64, 48));
    for (int i = 0; i < 5; ++i) video.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(128)));
  }
  EXPECT_THAT(MessageOf<Error>([&] { Ingest({file}, {}, folder / "frames"); }),
              HasSubstr("fog.avi: expected frames with texture, found none among 5; give `every`"));
  EXPECT_EQ(Ingest({file}, {.every = 2}, folder / "every").photos.size(), 3u);
}

TEST(IngestVideos, AVideoCutShortIsTakenAsFarAsItGoesAndListed) {
  const TemporaryFolder folder;
  WriteVideo(folder / "walk.avi", Places(40, 4));
  const std::string whole = ReadFile(folder / "walk.avi", 1 << 26);
  int taken = 0;
  for (int part = 0; part < 8; ++part) {
    WriteFileAtomically(folder / "cut.avi",
                        whole.substr(0, whole.size() * static_cast<size_t>(part) / 8));
    const fs::path frames = folder / ("frames" + std::to_string(part));
    try {
      const Capture capture = Ingest({folder / "cut.avi"}, {.every = 4}, frames);
      EXPECT_FALSE(capture.photos.empty());
      EXPECT_LE(capture.photos.size(), 10u);
      ASSERT_EQ(capture.skipped.size(), 1u) << part;
      EXPECT_THAT(capture.skipped[0].reason, HasSubstr("cut short"));
      ++taken;
    } catch (const Error&) {  // too short for a frame
    }
  }
  EXPECT_GE(taken, 4);
}

// Cuts a video once its frames are chosen.
class CutBeforeWriting final : public Progress {
 public:
  explicit CutBeforeWriting(fs::path video) : video_(std::move(video)) {}
  void Stage(const std::string& name, int) override {
    if (name == "writing frames") fs::resize_file(video_, fs::file_size(video_) / 2);
  }
  void Update(int) override {}
  void Note(const std::string&) override {}

 private:
  fs::path video_;
};

TEST(IngestVideos, AVideoThatChangesWhileItIsReadIsAnErrorAndNotAShorterOne) {
  const TemporaryFolder folder;
  WriteVideo(folder / "walk.avi", Places(40, 4));
  CutBeforeWriting progress(folder / "walk.avi");
  fs::create_directories(folder / "frames");
  EXPECT_THAT(MessageOf<Error>([&] {
                IngestVideos({folder / "walk.avi"}, {.every = 1}, folder / "frames", progress);
              }),
              HasSubstr("again, found the end after"));
}

TEST(IngestVideos, NamesThatJsonCannotHoldAreRejectedFirst) {
  const TemporaryFolder folder;
  for (const char* name : {"caf\xe9.avi", "two\nlines.avi"}) {
    EXPECT_THAT(MessageOf<Error>([&] { Ingest({folder / name}, {}, folder / "frames"); }),
                HasSubstr("expected a video whose name is printable UTF-8"));
  }
}

TEST(VideosOf, AreAVideoOrAFolderOfNothingElse) {
  const TemporaryFolder folder;
  WriteFileAtomically(folder / "b.MP4", "x");
  WriteFileAtomically(folder / "a.mov", "x");
  WriteFileAtomically(folder / "notes.txt", "x");
  EXPECT_THAT(VideosOf(folder.path()), ElementsAre(folder / "a.mov", folder / "b.MP4"));
  EXPECT_THAT(VideosOf(folder / "a.mov"), ElementsAre(folder / "a.mov"));
  EXPECT_THAT(VideosOf(folder / "notes.txt"), IsEmpty());
  for (const char* ours :
       {"set.dtr", "set.dtr.partial", "set.dtr.partial.work", "cut.partial", "capture"}) {
    fs::create_directory(folder / ours);
  }
  WriteFileAtomically(folder / "capture/capture.json", "{}");
  EXPECT_EQ(VideosOf(folder.path()).size(), 2u);
  WriteFileAtomically(folder / "a.lrv", "x");  // the same at low resolution
  EXPECT_EQ(VideosOf(folder.path()).size(), 2u);
  EXPECT_THAT(VideosOf(folder / "a.lrv"), ElementsAre(folder / "a.lrv"));
  fs::create_directory(folder / "sub");
  EXPECT_THAT(VideosOf(folder.path()), IsEmpty());
  fs::remove(folder / "sub");
  WriteFileAtomically(folder / "photo.jpg", "x");
  EXPECT_THAT(VideosOf(folder.path()), IsEmpty());
}

}  // namespace
}  // namespace dtr::capture
