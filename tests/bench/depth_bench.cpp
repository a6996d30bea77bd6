// tests/bench/depth_bench.cpp -- how small do depth maps get within a stated error, and how fast
// are they read?
//
//   depth_bench SET.dtr [ERROR_PX...]
//
// Of the source views of a set, all together: bytes without loss (inverse depth in 65534 steps, as
// 16-bit PNG, and in our own bands), then within each error (pixels of disparity, default 0.125 and
// 0.25) in the fewest steps that keep it, as PNG and as bands. Beside that the largest error found
// and the pixels decoded in a CPU second by one thread, median of 9 runs.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/code_bands.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/set_io.h"
#include "dtr/render/scene.h"

namespace {

using namespace dtr;
namespace fs = std::filesystem;

constexpr int kRepeats = 9;
constexpr std::uintmax_t kFileLimit = std::uintmax_t{1} << 32;

double CpuSeconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double MedianSeconds(const std::function<void()>& run) {
  std::vector<double> seconds;
  for (int i = 0; i <= kRepeats; ++i) {
    const double start = CpuSeconds();
    run();
    if (i > 0) seconds.push_back(CpuSeconds() - start);
  }
  std::nth_element(seconds.begin(), seconds.begin() + kRepeats / 2, seconds.end());
  return seconds[kRepeats / 2];
}

struct Sum {
  double png_bytes = 0, band_bytes = 0, pixels = 0, png_s = 0, band_s = 0, worst_px = 0;
};

// Without loss where `error_px` is 0. Throws Error where 16 bits are not that exact.
void Add(const View& view, double error_px, const fs::path& scratch, Sum& sum) {
  View coded = view;
  io::ClampToRange(coded);
  const double px = ThresholdsOf(view, {}).pixel;
  const int steps = error_px > 0 ? io::StepsForError(view.near_z, view.far_z, error_px * px)
                                 : InverseDepthCode::kSteps;
  const auto codes = io::EncodeInverseDepth(coded.depth, view.near_z, view.far_z, steps);
  io::WritePng16(scratch, codes);
  sum.png_bytes += static_cast<double>(fs::file_size(scratch));
  sum.png_s += MedianSeconds([&] { io::ReadPng16(scratch); });
  const std::string bands = io::EncodeBands(codes);
  WriteFileAtomically(scratch, bands);
  sum.band_bytes += static_cast<double>(bands.size());
  sum.band_s += MedianSeconds(
      [&] { io::DecodeBands(ReadFile(scratch, kFileLimit), codes.width(), codes.height()); });
  sum.pixels += static_cast<double>(codes.width()) * codes.height();
  const DepthImage back = io::DecodeInverseDepth(codes, view.near_z, view.far_z, steps);
  const auto& was = coded.depth.grid().data();
  const auto& is = back.grid().data();
  for (size_t i = 0; i < was.size(); ++i) {
    if (DepthImage::IsHole(was[i])) continue;
    sum.worst_px = std::max(sum.worst_px, std::abs(1.0 / is[i] - 1.0 / was[i]) / px);
  }
}

int Run(const fs::path& folder, const std::vector<double>& errors_px) {
  io::LoadOptions load;
  load.images = false;
  const DtrSet set = io::LoadSet(folder, load);
  const fs::path scratch = fs::temp_directory_path() / fmt::format("depth_bench_{}", getpid());
  fmt::print("{:>10} {:>10} {:>10} {:>8} {:>9} {:>12} {:>12} {:>12}\n", "within px", "PNG MB",
             "bands MB", "smaller", "worst px", "PNG Mpx/s", "bands Mpx/s", "pixels M");
  double lossless_bytes = 0;
  for (const double error_px : errors_px) {
    Sum sum;
    for (const View& view : set.frames.front().views) {
      if (!view.depth.empty()) Add(view, error_px, scratch, sum);
    }
    if (error_px == 0) lossless_bytes = sum.png_bytes;
    fmt::print("{:>10} {:>10.2f} {:>10.2f} {:>8.2f} {:>9.4f} {:>12.1f} {:>12.1f} {:>12.2f}\n",
               error_px == 0 ? "no loss" : fmt::format("{:g}", error_px), sum.png_bytes / 1e6,
               sum.band_bytes / 1e6, lossless_bytes / sum.band_bytes, sum.worst_px,
               sum.pixels / 1e6 / sum.png_s, sum.pixels / 1e6 / sum.band_s, sum.pixels / 1e6);
  }
  fs::remove(scratch);
  return EXIT_SUCCESS;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: depth_bench SET.dtr [ERROR_PX...]\n");
    return EXIT_FAILURE;
  }
  try {
    std::vector<double> errors_px{0};
    for (int i = 2; i < argc; ++i) errors_px.push_back(std::stod(argv[i]));
    if (argc == 2) errors_px.insert(errors_px.end(), {0.125, 0.25});
    return Run(argv[1], errors_px);
  } catch (const std::exception& error) {
    fmt::print(stderr, "depth_bench: {}\n", error.what());
    return EXIT_FAILURE;
  }
}
