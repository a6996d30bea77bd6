#include "dtr/io/camera_videos.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/file_stream.h"
#include "dtr/base/files.h"
#include "dtr/base/hash.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/process.h"
#include "dtr/base/work_folder.h"
#include "dtr/io/set_io.h"
#include "dtr/io/video_frames.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

/// To read a time step half of them are decoded on average; more would save little
/// (docs/DYNAMIC.md).
constexpr size_t kFramesPerVideo = 10;
static_assert(kFramesPerVideo <= kMaxVideoFrames);
constexpr int kMaxCrf = 51;  // of 8-bit H.264
/// Of libx264, with ten frames waiting and sixteen to refer to.
constexpr double kEncoderBytesPerPixel = 200;

/// Consecutive time steps of one camera.
using Clip = std::vector<View*>;

std::vector<Clip> ClipsOf(DtrSet& set) {
  std::map<std::string, Clip> cameras;
  for (Frame& frame : set.frames) {
    for (View& view : frame.views) {
      if (view.role != ViewRole::kSource || !view.image_file || view.image_frame) continue;
      cameras[fmt::format("{}x{} {}", view.camera.width_px(), view.camera.height_px(), view.name)]
          .push_back(&view);
    }
  }
  std::vector<Clip> clips;
  for (const auto& [key, views] : cameras) {
    if (views.size() < 2) continue;
    for (size_t begin = 0; begin < views.size(); begin += kFramesPerVideo) {
      const size_t end = std::min(views.size(), begin + kFramesPerVideo);
      clips.emplace_back(views.begin() + static_cast<std::ptrdiff_t>(begin),
                         views.begin() + static_cast<std::ptrdiff_t>(end));
    }
  }
  return clips;
}

void WriteRaw(const fs::path& file, const fs::path& set_folder, const Clip& clip, bool lossless) {
  FileStream out(file);
  LoadOptions load;
  load.depth = false;
  for (const View* view : clip) {
    View loaded = *view;
    LoadPixels(set_folder, loaded, load);
    const std::vector<std::uint8_t> bytes =
        lossless ? loaded.image.data() : YCbCrFromRgb(loaded.image);
    out.Write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }
  out.Flush();
}

/// One thread, as the bytes depend on it; no words of FFmpeg's that name its version. Images are
/// measured and blended, not looked at: no detail for the eye alone (psnr).
std::vector<std::string> EncoderCommand(const VideoQuality& quality, const PinholeCamera& camera) {
  const std::string format = quality.lossless ? "rgb24" : "yuvj444p";
  std::vector<std::string> command{"ffmpeg",
                                   "-y",
                                   "-loglevel",
                                   "error",
                                   "-f",
                                   "rawvideo",
                                   "-pixel_format",
                                   format,
                                   "-video_size",
                                   fmt::format("{}x{}", camera.width_px(), camera.height_px()),
                                   "-framerate",
                                   "24"};
  // Of the input, too: FFmpeg from 7.1 on converts colours that are not stated.
  const std::vector<std::string> colours{
      "-color_range",     "pc",    "-colorspace", "bt709",
      "-color_primaries", "bt709", "-color_trc",  "iec61966-2-1"};
  if (!quality.lossless) command.insert(command.end(), colours.begin(), colours.end());
  command.insert(command.end(), {"-i", "frames.raw", "-map_metadata", "-1", "-fflags", "+bitexact",
                                 "-threads", "1", "-preset", "slow"});
  const std::vector<std::string> coding =
      quality.lossless
          ? std::vector<std::string>{"-c:v", "libx264rgb", "-qp", "0"}
          : std::vector<std::string>{"-c:v",  "libx264", "-crf", std::to_string(quality.crf),
                                     "-tune", "psnr"};
  command.insert(command.end(), coding.begin(), coding.end());
  if (!quality.lossless) command.insert(command.end(), colours.begin(), colours.end());
  command.insert(command.end(), {"-pix_fmt", format, "video.mp4"});
  return command;
}

StoredFile Encoded(const fs::path& set_folder, const fs::path& work_folder, const Clip& clip,
                   const VideoQuality& quality, const Progress& progress) {
  const std::string path = "video/" + clip.front()->id + ".mp4";
  const WorkFolder work(work_folder / (clip.front()->id + ".video"), "video");
  WriteRaw(work.path() / "frames.raw", set_folder, clip, quality.lossless);
  ProcessOptions options;
  options.working_directory = work.path();
  std::string last_line;
  options.on_line = [&last_line](const std::string& line) { last_line = line; };
  options.should_stop = [&progress] { return progress.StopRequested(); };
  const auto result = RunProcess(EncoderCommand(quality, clip.front()->camera), options);
  progress.ThrowIfInterrupted();
  if (!result.Ok()) {
    throw Error(fmt::format("{}: ffmpeg failed with exit code {}: {}", (set_folder / path).string(),
                            result.exit_code, last_line));
  }
  fs::create_directories((set_folder / path).parent_path());
  PublishFile(work.path() / "video.mp4", set_folder / path);
  return {path, Sha256OfFile(set_folder / path), fs::file_size(set_folder / path)};
}

}  // namespace

VideoQuality VideoQualityFrom(const std::string& word) {
  VideoQuality quality;
  if (word == "lossless") {
    quality.lossless = true;
    return quality;
  }
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), quality.crf);
  if (error == std::errc() && end == word.data() + word.size() && quality.crf >= 1 &&
      quality.crf <= kMaxCrf) {
    return quality;
  }
  throw UsageError(fmt::format(
      "`video`: expected a rate factor of 1 to {}, or lossless, found '{}'", kMaxCrf, word));
}

std::string NameOf(const VideoQuality& quality) {
  return quality.lossless ? "lossless" : std::to_string(quality.crf);
}

void RequireVideoEncoder() {
  if (!FindProgram("ffmpeg").empty()) return;
  throw UsageError(
      "`video`: program ffmpeg not found on the PATH; install it or leave `video` out");
}

void StoreCameraVideos(const fs::path& set_folder, const fs::path& work_folder, DtrSet& set,
                       const VideoQuality& quality, double memory_gb, Progress& progress) {
  const std::vector<Clip> clips = ClipsOf(set);
  progress.Stage("images as video", static_cast<int>(clips.size()));
  MemoryBudget memory(memory_gb);
  std::atomic<int> done = 0;
  ParallelFor(0, static_cast<int>(clips.size()), [&](int i) {
    progress.ThrowIfInterrupted();
    const Clip& clip = clips[static_cast<size_t>(i)];
    const PinholeCamera& camera = clip.front()->camera;
    const auto share = memory.Take(kEncoderBytesPerPixel * camera.width_px() * camera.height_px());
    const StoredFile video = Encoded(set_folder, work_folder, clip, quality, progress);
    for (size_t k = 0; k < clip.size(); ++k) {
      clip[k]->image_file = video;
      clip[k]->image_frame = static_cast<int>(k);
    }
    progress.Update(++done);
  });
}

}  // namespace dtr::io
