// dtr/io/image_codecs.h -- internal to dtr/io: OpenImageIO behind types of our own. With the 260
// libraries that it needs it takes 0.3 s of processor time to load, so a program may load it with
// the first image: dtr/io/oiio/.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace dtr::io {

/// Type of the numbers of a channel.
enum class Sample { kUint8, kUint16, kHalf, kFloat, kDouble, kOther };

inline bool IsFloat(Sample sample) {
  return sample == Sample::kHalf || sample == Sample::kFloat || sample == Sample::kDouble;
}

/// What a file states of its image. Attributes have OpenImageIO's names and conversions.
class ImageFacts {
 public:
  virtual ~ImageFacts() = default;

  int x = 0, y = 0, width = 0, height = 0, depth = 1;
  int full_x = 0, full_y = 0, full_width = 0, full_height = 0;
  int tile_width = 0, tile_height = 0;
  int channels = 0;
  int alpha_channel = -1;
  std::vector<std::string> channel_names;
  Sample sample = Sample::kOther;
  std::string sample_name;                   ///< "uint8", ...
  size_t sample_bytes = 0, pixel_bytes = 0;  ///< in the file

  virtual int Int(const char* name, int without) const = 0;
  virtual float Float(const char* name, float without) const = 0;
  virtual std::string Text(const char* name) const = 0;
  /// All numbers of an attribute; empty where there is none.
  virtual std::vector<float> Floats(const char* name) const = 0;
  /// An attribute that is bytes; empty where there is none.
  virtual std::vector<std::uint8_t> Bytes(const char* name) const = 0;
};

/// A file of which the first image can be read.
class OpenedImage {
 public:
  virtual ~OpenedImage() = default;
  virtual const ImageFacts& facts() const = 0;
  virtual std::string format() const = 0;  ///< "jpeg", "png", ...
  /// The facts with EXIF (a TIFF; may be empty) that the decoder left in the file; `upright`: with
  /// an orientation that needs no rotation.
  virtual std::unique_ptr<ImageFacts> FactsWith(const std::string& exif, bool upright) const = 0;
  /// Reads channels [first, end) as `sample`. False, or a complaint, where the file is damaged.
  virtual bool Read(int first_channel, int end_channel, Sample sample, void* pixels,
                    std::string& complaint) = 0;
  virtual bool HasSecondImage() = 0;
  virtual void Close() = 0;
};

/// An image to be encoded, without its pixels.
struct ImageToWrite {
  int width = 0, height = 0, channels = 0;
  Sample sample = Sample::kUint8;  ///< in the file
  std::vector<std::pair<std::string, std::variant<int, float, std::string>>> attributes = {};
  std::vector<std::string> channel_names = {};  ///< empty: by their number
};

/// zlib's. Photos come out 7 % larger than at its own level 6, in a third of the time
/// (docs/FORMAT.md).
inline constexpr int kPngLevel = 2;

class ImageCodecs {
 public:
  virtual ~ImageCodecs() = default;
  /// No image, and why, where the file cannot be opened. `raw_balance`: see ImageReadOptions.
  virtual std::unique_ptr<OpenedImage> Open(const std::string& file,
                                            const std::optional<std::array<double, 3>>& raw_balance,
                                            std::string& complaint) const = 0;
  /// The file's bytes, of pixels given as `sample`; none, and why, where that fails.
  virtual std::optional<std::string> Encode(const std::string& extension, const ImageToWrite& image,
                                            Sample sample, const void* pixels,
                                            std::string& complaint) const = 0;
  virtual std::string FormatList() const = 0;  ///< see ImageFormatList()
};

/// Throws Error where the library cannot be loaded. From any thread.
const ImageCodecs& Codecs();

}  // namespace dtr::io
