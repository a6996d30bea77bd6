// capture/video/frame_colours.h -- internal: a decoded frame as 8-bit sRGB of square pixels.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "capture/video/ffmpeg_handles.h"
#include "dtr/io/colour_coding.h"
#include "dtr/types/grid.h"

namespace dtr::capture {

/// What of a frame decides how it is converted.
struct FrameKind {
  int width = 0, height = 0, format = -1;
  int matrix = 0, primaries = 0, transfer = 0;  ///< H.273
  bool full_range = false;
  int chroma_location = 0;
  int out_width = 0, out_height = 0;  ///< where pixels are made square

  bool operator==(const FrameKind&) const = default;
};

/// `sample_aspect` is width over height of one pixel; 0: not stated. Resolves what the frame does
/// not state as players do: BT.709's matrix for HD, BT.601's for less; limited range.
FrameKind KindOf(const AVFrame& frame, AVRational sample_aspect);

/// What of frames of this kind cannot be converted; empty where they can.
std::string WhyNotConverted(const FrameKind& kind);

/// One line for everything about such frames that a user should know.
std::vector<std::string> RemarksOn(const AVFrame& frame, const FrameKind& kind);

/// Converts frames of one kind.
class FrameConverter {
 public:
  /// Requires WhyNotConverted(kind) to be empty. Throws std::runtime_error where memory is short.
  explicit FrameConverter(const FrameKind& kind);

  const FrameKind& kind() const { return kind_; }
  ImageRgb8 Convert(const AVFrame& frame);

 private:
  FrameKind kind_;
  Ffmpeg<SwsContext> scaler_;
  std::vector<std::uint8_t> rows_;            // as swscale writes them
  std::optional<io::SrgbConverter> to_srgb_;  // none: the numbers are sRGB already
};

}  // namespace dtr::capture
