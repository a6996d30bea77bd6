// dtr/io/formats/lzfse_parts.h -- what the kinds of LZFSE blocks share. Internal to dtr/io/formats.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace dtr::io::internal {

/// Why a stream cannot be decoded; DecodeLzfse makes the line out of it.
struct LzfseFault {
  const char* found;
};

/// Bytes decoded so far, of all blocks.
class LzfseOutput {
 public:
  explicit LzfseOutput(size_t max_bytes) : max_bytes_(max_bytes) {}
  void Append(std::string_view bytes) {
    RequireRoom(bytes.size());
    bytes_.append(bytes);
  }
  /// Appends `length` bytes, each of which is the one `distance` before it.
  void Repeat(size_t distance, size_t length) {
    if (length == 0) return;
    if (distance == 0 || distance > bytes_.size()) {
      throw LzfseFault{"a reference to bytes before the first"};
    }
    RequireRoom(length);
    for (size_t i = 0; i < length; ++i) bytes_.push_back(bytes_[bytes_.size() - distance]);
  }
  size_t size() const { return bytes_.size(); }
  std::string Take() { return std::move(bytes_); }

 private:
  void RequireRoom(size_t more) const {
    if (more > max_bytes_ - bytes_.size()) throw LzfseFault{"more bytes than it may stand for"};
  }
  std::string bytes_;
  size_t max_bytes_;
};

/// Bytes of a block, from the front.
class LzfseBytes {
 public:
  explicit LzfseBytes(std::string_view bytes) : bytes_(bytes) {}
  bool empty() const { return bytes_.empty(); }
  std::string_view Take(size_t count) {
    if (count > bytes_.size()) throw LzfseFault{"its end before that of a block"};
    const std::string_view taken = bytes_.substr(0, count);
    bytes_.remove_prefix(count);
    return taken;
  }
  /// A little-endian number of so many bytes, at most 8.
  std::uint64_t Number(size_t count) {
    std::uint64_t number = 0;
    unsigned shift = 0;
    for (const char byte : Take(count)) {
      number |= std::uint64_t{static_cast<unsigned char>(byte)} << shift;
      shift += 8;
    }
    return number;
  }

 private:
  std::string_view bytes_;
};

/// Appends what an LZVN block's payload stands for.
void DecodeLzvn(std::string_view payload, LzfseOutput& output);

/// Takes an entropy-coded block, whose mark has been read, and appends what it stands for.
/// `packed`: its header has the short form, `bvx2`.
void DecodeEntropyBlock(LzfseBytes& stream, bool packed, LzfseOutput& output);

}  // namespace dtr::io::internal
