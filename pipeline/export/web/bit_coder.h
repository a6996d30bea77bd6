// pipeline/export/web/bit_coder.h -- an adaptive binary range coder.
#pragma once
#include <cstdint>
#include <string>

namespace dtr::pipeline {

/// How probable a 0 is in one context: the mean of a quick and a slow estimate, in 65536ths.
struct BitModel {
  static constexpr int kQuickShift = 4, kSlowShift = 7;
  static constexpr std::uint32_t kLeast = 48, kMost = 65488;  // neither bit is ever impossible
  std::uint16_t quick = 32768, slow = 32768;

  std::uint32_t OfZero() const {
    const std::uint32_t mean = (std::uint32_t{quick} + slow) >> 1;
    return mean < kLeast ? kLeast : mean > kMost ? kMost : mean;
  }
  void Learn(bool bit) {
    const auto towards = [bit](std::uint16_t& value, int shift) {
      value = static_cast<std::uint16_t>(bit ? value - (value >> shift)
                                             : value + ((65535 - value) >> shift));
    };
    towards(quick, kQuickShift);
    towards(slow, kSlowShift);
  }
};

/// Range coder with carries (G. N. N. Martin, "Range encoding", 1979), 32 bits wide. The page's
/// js/bit_decoder.js is its inverse; docs/EXPORT.md has the format.
class BitEncoder {
 public:
  void Put(BitModel& model, bool bit) {
    const std::uint32_t zeros = (range_ >> 16) * model.OfZero();
    if (bit) {
      low_ += zeros;
      range_ -= zeros;
    } else {
      range_ = zeros;
    }
    model.Learn(bit);
    while (range_ < kLeastRange) {
      range_ <<= 8;
      ShiftByte();
    }
  }

  /// The bytes; nothing can be put after it.
  std::string Finish() {
    for (int i = 0; i < 5; ++i) ShiftByte();
    return std::move(bytes_);
  }

 private:
  static constexpr std::uint32_t kLeastRange = std::uint32_t{1} << 24;

  // Bytes of 255 wait, as a carry may run through them.
  void ShiftByte() {
    const auto carry = static_cast<std::uint32_t>(low_ >> 32);
    const auto low = static_cast<std::uint32_t>(low_);
    if (carry != 0 || low < 0xff000000u) {
      for (std::uint32_t byte = held_; waiting_ > 0; --waiting_, byte = 255) {
        bytes_ += static_cast<char>((byte + carry) & 255);
      }
      held_ = low >> 24;
    }
    ++waiting_;
    low_ = std::uint64_t{low << 8};
  }

  std::uint64_t low_ = 0;
  std::uint32_t range_ = 0xffffffff, held_ = 0;
  std::uint64_t waiting_ = 1;
  std::string bytes_;
};

}  // namespace dtr::pipeline
