// tests/capture/video/ffmpeg_videos.h -- videos that the program ffmpeg writes.
#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "dtr/base/files.h"
#include "dtr/base/process.h"
#include "tests/support/test_data.h"

namespace dtr::capture::testing {

using Arguments = std::vector<std::string>;

inline void RunFfmpeg(const std::filesystem::path& folder, const Arguments& arguments) {
  Arguments command{"ffmpeg", "-y", "-loglevel", "error"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  ProcessOptions options;
  options.working_directory = folder;
  options.log_file = folder / "ffmpeg.log";
  ASSERT_TRUE(RunProcess(command, options).Ok()) << ReadFile(folder / "ffmpeg.log", 1 << 20);
}

/// Frames of one grey that differ: number n has the value 20 + 10 n modulo 256.
inline void WriteCounted(const dtr::testing::TemporaryFolder& folder, const std::string& name,
                         int frames, const Arguments& more) {
  std::string bytes;
  for (int i = 0; i < frames; ++i) {
    bytes += std::string(64 * 48, static_cast<char>(20 + 10 * i));
    bytes += std::string(64 * 24, static_cast<char>(128));
  }
  WriteFileAtomically(folder / "counted.yuv", bytes);
  Arguments arguments{"-f",    "rawvideo", "-pix_fmt", "yuv420p", "-s",
                      "64x48", "-r",       "10",       "-i",      "counted.yuv"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  arguments.push_back(name);
  RunFfmpeg(folder.path(), arguments);
}

}  // namespace dtr::capture::testing
