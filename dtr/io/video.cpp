#include "dtr/io/video.h"

#include <fmt/format.h>

#include <string>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/process.h"
#include "dtr/io/image_io.h"

namespace dtr::io {
namespace fs = std::filesystem;
namespace {

// How FFmpeg shall encode, as words of its command line.
std::vector<std::string> WordsOf(VideoCoding coding) {
  if (coding == VideoCoding::kLossless) {
    return {"-c:v", "ffv1", "-level", "3", "-pix_fmt", "gbrp"};
  }
  // yuv420p, which every player knows, needs even sizes: an odd frame gains one row or column.
  // FFmpeg would code with BT.601's matrix and not say so, and players take BT.709's for HD. From
  // 7.1 on what frames say of their colours (setparams) counts, not the options behind.
  const std::string filter =
      "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd,"
      "setparams=color_primaries=bt709:color_trc=iec61966-2-1";
  return {"-vf",     filter,       "-colorspace",  "bt709",        "-color_primaries",
          "bt709",   "-color_trc", "iec61966-2-1", "-color_range", "tv",
          "-c:v",    "libx264",    "-crf",         "18",           "-pix_fmt",
          "yuv420p", "-movflags",  "+faststart"};
}

}  // namespace

VideoWriter::VideoWriter(fs::path target, int frames_per_second, VideoCoding coding)
    : target_(std::move(target)),
      frames_(WorkFolder::Of(target_), "video"),
      frames_per_second_(frames_per_second),
      coding_(coding) {
  if (FindProgram("ffmpeg").empty()) {
    throw Error(target_.string() +
                ": program ffmpeg not found on the PATH; install it or write images to a folder");
  }
}

void VideoWriter::Add(const ImageRgb8& frame) {
  WriteImage(frames_.path() / fmt::format("{:06}.png", count_++), frame);
}

void VideoWriter::Finish(const Progress& progress) {
  const fs::path& frames = frames_.path();
  // ffmpeg takes "%" and ":" in a path for words of its own: it sees names of ours alone.
  const char* encoded = coding_ == VideoCoding::kH264 ? "video.mp4" : "video.mkv";
  ProcessOptions options;
  options.log_file = frames / "ffmpeg.log";
  options.working_directory = frames;
  std::string last_line;
  options.on_line = [&last_line](const std::string& line) { last_line = line; };
  options.should_stop = [&progress] { return progress.StopRequested(); };
  std::vector<std::string> command{"ffmpeg", "-y",         "-loglevel",
                                   "error",  "-framerate", std::to_string(frames_per_second_),
                                   "-i",     "%06d.png"};
  const std::vector<std::string> words = WordsOf(coding_);
  command.insert(command.end(), words.begin(), words.end());
  command.push_back(encoded);
  const auto result = RunProcess(command, options);
  progress.ThrowIfInterrupted();
  if (!result.Ok()) {
    throw Error(fmt::format("{}: ffmpeg failed with exit code {}: {}", target_.string(),
                            result.exit_code, last_line));
  }
  PublishFile(frames / encoded, target_);
}

}  // namespace dtr::io
