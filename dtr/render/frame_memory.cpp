#include "dtr/render/frame_memory.h"

#include <algorithm>

#include "dtr/base/memory_budget.h"
#include "dtr/base/size_text.h"

namespace dtr {
namespace {

// Bytes a pixel (tests/render/frame_memory_test.cpp counts them):
// - RenderResult 10; the depth that is shown 4; hole filling 15: cells of 40 bytes on grids of half
//   the size and its halvings, and their masks; or edges 3;
// - or RenderResult, and the encoder: an image of 4 channels, its file twice while that grows.
// What renderers draw in, they draw in bands of rows of some 256 MiB, however large the image is.
constexpr double kFrameBytes = 32;
// libx264 with its frames waiting, to refer to, and being coded by each thread: 222 of full HD on
// two cores.
constexpr double kVideoBytes = 240;

double Pixels(int width_px, int height_px) { return static_cast<double>(width_px) * height_px; }

}  // namespace

double FrameBytes(int width_px, int height_px) { return kFrameBytes * Pixels(width_px, height_px); }

double VideoBytes(int width_px, int height_px) { return kVideoBytes * Pixels(width_px, height_px); }

void RequireFrameMemory(const PinholeCamera& camera, bool video, double memory_gb,
                        const std::string& whose) {
  const int width = camera.width_px(), height = camera.height_px();
  const std::string size = SizeText(width, height) + " pixels";
  const std::string advice = "give more, or a smaller `size`";
  RequireMemory(FrameBytes(width, height), memory_gb, whose + ": rendering " + size, advice);
  if (!video) return;
  RequireMemory(VideoBytes(width, height), memory_gb, whose + ": a video of " + size, advice);
}

double BytesForViews(const PinholeCamera& camera, double memory_gb) {
  const double frame = FrameBytes(camera.width_px(), camera.height_px());
  return memory_gb * kBytesPerGigabyte - std::max(0.0, frame - kAlwaysAllowedBytes);
}

}  // namespace dtr
