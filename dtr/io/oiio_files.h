// dtr/io/oiio_files.h -- internal to dtr/io: OpenImageIO with our rules on errors and limits.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "dtr/io/image_codecs.h"
#include "dtr/io/image_io.h"

namespace dtr::io {

/// As ImageReadOptions has them.
struct OpenLimits {
  std::uint64_t px = kImageLimitPx;
  double memory_gb = kImageMemoryGb;
};

/// Opens an image. `raw_balance`: see ImageReadOptions. Throws Error with one line when it cannot
/// be opened, is a PNG cut short, or has no pixels, more than the limits allow or more than its
/// file can hold; before OpenImageIO unpacks it, where that happens on opening.
std::unique_ptr<OpenedImage> OpenImage(const std::filesystem::path& file,
                                       const OpenLimits& limits = {},
                                       const std::optional<RawBalance>& raw_balance = {});

/// What the decoder of an opened image holds while it reads, beside what it hands out.
double DecoderBytes(const OpenedImage& in, const std::filesystem::path& file);

/// Throws Error, before anything of its size is allocated, where reading an image of the opened
/// one's size takes more memory than the limit, 1e9 bytes (0: none).
void ExpectMemory(const OpenedImage& in, const std::filesystem::path& file, double bytes,
                  double memory_gb);

/// Reads channels [0, channels) of the first image into `pixels`, which must have room. Any word of
/// complaint by the decoder is an Error: half-grey photos must not pass for whole ones.
void ReadPixels(OpenedImage& in, const std::filesystem::path& file, int first_channel,
                int end_channel, Sample sample, void* pixels);

/// Encodes an image in memory; `extension` chooses the format (".png", ".jpg", ".exr").
std::string EncodeImage(const std::string& extension, const ImageToWrite& image, Sample sample,
                        const void* pixels);

/// Throws Error unless the opened image has this size.
void ExpectSize(const OpenedImage& in, const std::filesystem::path& file, int width_px,
                int height_px);

}  // namespace dtr::io
