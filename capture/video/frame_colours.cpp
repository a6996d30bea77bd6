#include "capture/video/frame_colours.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "dtr/io/image_io.h"

namespace dtr::capture {
namespace {

constexpr double kMaxStretched = 10;  // pixels are never that much longer than wide

const AVPixFmtDescriptor& Descriptor(int format) {
  static const AVPixFmtDescriptor kNone{};
  const AVPixFmtDescriptor* found = av_pix_fmt_desc_get(static_cast<AVPixelFormat>(format));
  return found == nullptr ? kNone : *found;
}

bool IsRgb(int format) { return (Descriptor(format).flags & AV_PIX_FMT_FLAG_RGB) != 0; }

bool IsFullRangeFormat(int format) {
  switch (format) {
    case AV_PIX_FMT_YUVJ420P:
    case AV_PIX_FMT_YUVJ422P:
    case AV_PIX_FMT_YUVJ444P:
    case AV_PIX_FMT_YUVJ440P:
    case AV_PIX_FMT_YUVJ411P:
      return true;
    default:
      return IsRgb(format);
  }
}

int MatrixOf(const AVFrame& frame) {
  if (frame.colorspace != AVCOL_SPC_UNSPECIFIED && frame.colorspace != AVCOL_SPC_RESERVED) {
    return frame.colorspace;
  }
  if (IsRgb(frame.format)) return AVCOL_SPC_RGB;
  if (frame.color_primaries == AVCOL_PRI_BT2020) return AVCOL_SPC_BT2020_NCL;
  const bool high_definition = frame.width >= 1280 || frame.height > 576;
  return high_definition ? AVCOL_SPC_BT709 : AVCOL_SPC_SMPTE170M;
}

// No row or column is lost: the shorter side of a pixel is stretched.
void MakeSquare(AVRational aspect, FrameKind& kind) {
  kind.out_width = kind.width;
  kind.out_height = kind.height;
  if (aspect.num <= 0 || aspect.den <= 0) return;
  const double ratio = av_q2d(aspect);
  if (ratio > kMaxStretched || ratio < 1 / kMaxStretched) return;
  if (ratio > 1) kind.out_width = static_cast<int>(std::lround(kind.width * ratio));
  if (ratio < 1) kind.out_height = static_cast<int>(std::lround(kind.height / ratio));
}

// Chroma samples between luma samples, or left of that as H.264 has it where nothing is stated, are
// taken as FFmpeg and players take them: for both of the columns they were made of, since most
// encoders average whatever they state. Others, HDR's at the top left, are interpolated. True if
// so.
bool SetChromaPosition(SwsContext* scaler, const FrameKind& kind) {
  const AVPixFmtDescriptor& format = Descriptor(kind.format);
  const auto location = static_cast<AVChromaLocation>(kind.chroma_location);
  if (format.log2_chroma_w != 1 || format.log2_chroma_h != 1) return false;
  const bool top = location == AVCHROMA_LOC_TOPLEFT || location == AVCHROMA_LOC_TOP;
  const bool bottom = location == AVCHROMA_LOC_BOTTOMLEFT || location == AVCHROMA_LOC_BOTTOM;
  if (!top && !bottom) return false;
  const bool between = location == AVCHROMA_LOC_TOP || location == AVCHROMA_LOC_BOTTOM;
  // In 1/256 of a luma pixel, from the first one; FFmpeg's function for it has another name and
  // another library since version 6.
  av_opt_set_int(scaler, "src_h_chr_pos", between ? 128 : 0, 0);
  av_opt_set_int(scaler, "src_v_chr_pos", bottom ? 256 : 0, 0);
  return true;
}

std::string NameOr(const char* name) { return name == nullptr ? "unknown" : name; }

}  // namespace

FrameKind KindOf(const AVFrame& frame, AVRational sample_aspect) {
  FrameKind kind;
  kind.width = frame.width;
  kind.height = frame.height;
  kind.format = frame.format;
  kind.matrix = MatrixOf(frame);
  kind.primaries = frame.color_primaries;
  kind.transfer = frame.color_trc;
  kind.full_range = frame.color_range == AVCOL_RANGE_JPEG || IsFullRangeFormat(frame.format);
  kind.chroma_location = frame.chroma_location;
  MakeSquare(sample_aspect, kind);
  return kind;
}

std::string WhyNotConverted(const FrameKind& kind) {
  const auto out_px =
      static_cast<std::uint64_t>(kind.out_width) * static_cast<std::uint64_t>(kind.out_height);
  if (out_px == 0 || out_px > io::kImageLimitPx) {
    return fmt::format("a size of {}x{} pixels", kind.out_width, kind.out_height);
  }
  if (sws_isSupportedInput(static_cast<AVPixelFormat>(kind.format)) == 0) {
    return "the pixel format " + NameOr(Descriptor(kind.format).name);
  }
  switch (kind.matrix) {
    case AVCOL_SPC_RGB:
    case AVCOL_SPC_BT709:
    case AVCOL_SPC_FCC:
    case AVCOL_SPC_BT470BG:
    case AVCOL_SPC_SMPTE170M:
    case AVCOL_SPC_SMPTE240M:
    case AVCOL_SPC_BT2020_NCL:
      break;
    default:
      return "the colour matrix " +
             NameOr(av_color_space_name(static_cast<AVColorSpace>(kind.matrix)));
  }
  if (io::CodingOfH273(kind.primaries, kind.transfer)) return "";
  return fmt::format(
      "the transfer function {1} with the primaries {0}",
      NameOr(av_color_primaries_name(static_cast<AVColorPrimaries>(kind.primaries))),
      NameOr(av_color_transfer_name(static_cast<AVColorTransferCharacteristic>(kind.transfer))));
}

std::vector<std::string> RemarksOn(const AVFrame& frame, const FrameKind& kind) {
  std::vector<std::string> remarks;
  const auto coding = io::CodingOfH273(kind.primaries, kind.transfer);
  if (coding && io::IsHdr(*coding)) {
    remarks.push_back(
        fmt::format("HDR ({}): frames are converted to sRGB, highlights are compressed",
                    coding->transfer == io::Transfer::kPq ? "PQ" : "HLG"));
  }
  if (kind.out_width != kind.width || kind.out_height != kind.height) {
    remarks.push_back(fmt::format("its pixels are not square: frames of {}x{} are scaled to {}x{}",
                                  kind.width, kind.height, kind.out_width, kind.out_height));
  }
  const bool guessed = frame.colorspace == AVCOL_SPC_UNSPECIFIED && !IsRgb(frame.format) &&
                       Descriptor(frame.format).nb_components >= 3;
  if (guessed && kind.matrix == AVCOL_SPC_BT709) {
    remarks.push_back("it does not say its colour matrix: taken as BT.709, as players do for HD");
  }
  if ((Descriptor(frame.format).flags & AV_PIX_FMT_FLAG_ALPHA) != 0) {
    remarks.push_back("its alpha channel is not used");
  }
  return remarks;
}

FrameConverter::FrameConverter(const FrameKind& kind) : kind_(kind), scaler_(sws_alloc_context()) {
  const auto coding = io::CodingOfH273(kind.primaries, kind.transfer);
  const io::Primaries srgb;
  if (coding && (coding->transfer != io::Transfer::kSrgb || coding->primaries.red != srgb.red ||
                 coding->primaries.green != srgb.green)) {
    to_srgb_.emplace(*coding);
  }
  SwsContext* scaler = scaler_.get();
  av_opt_set_int(scaler, "srcw", kind.width, 0);
  av_opt_set_int(scaler, "srch", kind.height, 0);
  av_opt_set_int(scaler, "src_format", kind.format, 0);
  av_opt_set_int(scaler, "dstw", kind.out_width, 0);
  av_opt_set_int(scaler, "dsth", kind.out_height, 0);
  av_opt_set_int(scaler, "dst_format", to_srgb_ ? AV_PIX_FMT_RGB48 : AV_PIX_FMT_RGB24, 0);
  const bool square = kind.out_width == kind.width && kind.out_height == kind.height;
  const bool between = SetChromaPosition(scaler, kind);
  // Without full chroma, numbers are rounded to 2 or 3 levels.
  const int flags = (square && !between ? SWS_POINT : SWS_BICUBIC) | SWS_FULL_CHR_H_INT |
                    SWS_FULL_CHR_H_INP | SWS_ACCURATE_RND | SWS_BITEXACT;
  av_opt_set_int(scaler, "sws_flags", flags, 0);
  constexpr int kOne = 1 << 16;  // contrast and saturation as they are
  const int* matrix = sws_getCoefficients(kind.matrix);
  sws_setColorspaceDetails(scaler, matrix, kind.full_range ? 1 : 0, matrix, 1, 0, kOne, kOne);
  if (sws_init_context(scaler, nullptr, nullptr) < 0) {
    throw std::runtime_error("FFmpeg cannot convert frames of this kind");
  }
}

ImageRgb8 FrameConverter::Convert(const AVFrame& frame) {
  // swscale writes whole vectors, so past the end of a row.
  constexpr size_t kAlign = 64;
  const auto width = static_cast<size_t>(kind_.out_width);
  const size_t stride = ((to_srgb_ ? 6 : 3) * width + 2 * kAlign - 1) / kAlign * kAlign;
  rows_.resize(stride * static_cast<size_t>(kind_.out_height) + 2 * kAlign);
  void* begin = rows_.data();
  size_t space = rows_.size();
  auto* first = static_cast<std::uint8_t*>(std::align(kAlign, 1, begin, space));
  const std::array<std::uint8_t*, 4> planes{first};
  const std::array<int, 4> strides{static_cast<int>(stride)};
  sws_scale(scaler_.get(), frame.data, frame.linesize, 0, kind_.height, planes.data(),
            strides.data());
  ImageRgb8 image(kind_.out_width, kind_.out_height, 3);
  for (int y = 0; y < image.height(); ++y) {
    const std::uint8_t* row = first + stride * static_cast<size_t>(y);
    if (to_srgb_) {
      to_srgb_->Convert(reinterpret_cast<const std::uint16_t*>(row), width, image.row(y));
    } else {
      std::copy_n(row, 3 * width, image.row(y));
    }
  }
  return image;
}

}  // namespace dtr::capture
