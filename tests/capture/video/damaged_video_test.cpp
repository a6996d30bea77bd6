// Videos of which single frames cannot be decoded.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>

#include <cmath>

#include "capture/video/frame_numbers.h"
#include "capture/video/frames.h"
#include "capture/video/ingest_video.h"
#include "tests/capture/video/ffmpeg_videos.h"

namespace dtr::capture {
namespace {

namespace fs = std::filesystem;
using dtr::testing::TemporaryFolder;
using testing::Arguments;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::RunFfmpeg;
using testing::WriteCounted;

constexpr int kFrames = 20;

// 20 frames, 10 per second, each coded by itself; the bytes of packet `damaged` are noise.
void WriteDamaged(const TemporaryFolder& folder, const std::string& name, int damaged,
                  const Arguments& how = {"-c:v", "libx264", "-qp", "0", "-g", "1"}) {
  const std::string whole = "whole" + fs::path(name).extension().string();
  WriteCounted(folder, whole, kFrames, how);
  RunFfmpeg(folder.path(),
            {"-i", whole, "-c", "copy", "-bsf:v",
             "noise=amount=if(eq(n\\," + std::to_string(damaged) + ")\\,1\\,0)", name});
}

// FFmpeg decodes with as many threads as there are CPUs.
class Cpus {
 public:
  explicit Cpus(int count) {
    sched_getaffinity(0, sizeof before_, &before_);
    cpu_set_t some;
    CPU_ZERO(&some);
    for (int cpu = 0; cpu < CPU_SETSIZE && CPU_COUNT(&some) < count; ++cpu) {
      if (CPU_ISSET(cpu, &before_)) CPU_SET(cpu, &some);
    }
    sched_setaffinity(0, sizeof some, &some);
  }
  ~Cpus() { sched_setaffinity(0, sizeof before_, &before_); }

 private:
  cpu_set_t before_;
};

// Numbers, times and contents agree, and all frames but `damaged` come.
void ExpectAllBut(const fs::path& file, int damaged) {
  VideoReader video(file);
  std::vector<int> numbers, expected;
  while (video.Next()) {
    numbers.push_back(video.number());
    EXPECT_NEAR(video.time_s(), 0.1 * video.number(), 2e-3);
    const double grey = (20 + 10 * video.number() - 16) * 255 / 219.0;
    EXPECT_NEAR(video.Picture()(5, 5, 0), grey, 2);
  }
  for (int i = 0; i < kFrames; ++i) {
    if (i != damaged) expected.push_back(i);
  }
  EXPECT_EQ(numbers, expected);
  EXPECT_EQ(video.frames_so_far(), kFrames);
  EXPECT_EQ(video.WhyIncomplete(), "1 damaged frame is left out");
}

TEST(DamagedVideo, FramesAfterADamagedOneKeepTheirNumbersForAnyNumberOfCpus) {
  const TemporaryFolder folder;
  for (const char* name : {"damaged.mp4", "damaged.mkv"}) {
    for (const int damaged : {0, 9, kFrames - 2, kFrames - 1}) {
      WriteDamaged(folder, name, damaged);
      for (const int cpus : {1, 2, 4}) {
        SCOPED_TRACE(std::string(name) + " " + std::to_string(damaged) + " " +
                     std::to_string(cpus));
        const Cpus some(cpus);
        ExpectAllBut(folder / name, damaged);
      }
    }
  }
}

TEST(DamagedVideo, FramesThatAreShownInAnotherOrderKeepTheirNumbersToo) {
  const TemporaryFolder folder;
  WriteDamaged(folder, "damaged.mp4", 15,
               {"-c:v", "libx264", "-qp", "0", "-bf", "2", "-x264-params",
                "b-adapt=0:b-pyramid=none:scenecut=0"});
  VideoReader video(folder / "damaged.mp4");
  int frames = 0;
  while (video.Next()) {
    ++frames;
    EXPECT_EQ(video.number(), std::lround(10 * video.time_s()));
  }
  EXPECT_LT(frames, kFrames);
  EXPECT_EQ(video.frames_so_far(), kFrames);
}

TEST(DamagedVideo, SynchronisedVideosLeaveOutWhatIsDamagedInOne) {
  const TemporaryFolder folder;
  WriteDamaged(folder, "right.mp4", 10);
  fs::rename(folder / "whole.mp4", folder / "left.mp4");
  SilentProgress progress;
  fs::create_directories(folder / "frames");
  const Capture capture =
      IngestVideos({folder / "left.mp4", folder / "right.mp4"}, {.every = 5, .synchronised = true},
                   folder / "frames", progress);
  std::vector<int> numbers;
  for (const Photo& photo : capture.photos) numbers.push_back(photo.video_frame->number);
  EXPECT_THAT(numbers, ElementsAre(0, 5, 11, 15, 0, 5, 11, 15));
  EXPECT_TRUE(capture.remarks.empty());
  ASSERT_EQ(capture.skipped.size(), 1u);
  EXPECT_EQ(capture.skipped[0].name, "right.mp4");
  EXPECT_THAT(capture.skipped[0].reason, HasSubstr("1 damaged frame is left out"));
}

// Fields and frames that are never shown are coded frames that nobody reports as damaged.
TEST(FrameNumbers, CountWhatIsLostAndNotWhatIsMerelyNotShown) {
  FrameNumbers numbers;
  for (int time = 0; time < 12; ++time) numbers.Read(time, time);
  EXPECT_EQ(numbers.Next(0), 0);
  EXPECT_EQ(numbers.Next(2), 1);  // 1 was a second field
  numbers.Lose();
  EXPECT_EQ(numbers.count(), 3);
  EXPECT_EQ(numbers.Next(3), 2);  // what is lost is shown later
  EXPECT_EQ(numbers.Next(5), 4);
  EXPECT_EQ(numbers.count(), 5);
  EXPECT_EQ(numbers.lost_behind(), 0);
}

TEST(FrameNumbers, TimesBeginAgainWhereStreamsAreJoined) {
  FrameNumbers numbers;
  for (const int time : {5, 6, 7, 5, 6, 7}) numbers.Read(time, time);
  numbers.Lose();  // the second 6
  for (const auto& [time, number] : {std::pair(5, 0), {6, 1}, {7, 2}, {5, 3}, {7, 5}}) {
    EXPECT_EQ(numbers.Next(time), number);
  }
}

TEST(FrameNumbers, WithoutTimesFramesAreCounted) {
  FrameNumbers numbers;
  for (int i = 0; i < 4; ++i) numbers.Read({}, {});
  EXPECT_EQ(numbers.Next({}), 0);
  numbers.Lose();
  EXPECT_EQ(numbers.Next({}), 2);
  EXPECT_EQ(numbers.Next({}), 3);
}

}  // namespace
}  // namespace dtr::capture
