// pipeline/detail/web/range_encoder.h -- an adaptive binary range coder (Martin, Range encoding,
// 1979, with the carry of Schindler and the byte order of LZMA); its decoder is
// viewer/web/js/range_decoder.js.
#pragma once
#include <algorithm>
#include <cstdint>
#include <string>

namespace dtr::pipeline {

/// Probability that a bit is 1, of 65536: the mean of one that adapts fast and one that adapts
/// slowly.
struct BitModel {
  std::uint16_t fast = 32768, slow = 32768;

  /// Of 32768, never 0 or 1.
  std::uint32_t Probability() const {
    return std::clamp<std::uint32_t>((std::uint32_t{fast} + slow) >> 2, 32, 32736);
  }
  void Adapt(bool bit) {
    fast = Moved(fast, bit, 4);
    slow = Moved(slow, bit, 7);
  }

 private:
  static std::uint16_t Moved(int value, bool bit, int shift) {
    return static_cast<std::uint16_t>(bit ? value + ((65535 - value) >> shift)
                                          : value - (value >> shift));
  }
};

class RangeEncoder {
 public:
  void Put(BitModel& model, bool bit) {
    const std::uint32_t bound = (range_ >> 15) * model.Probability();
    model.Adapt(bit);
    Narrow(bound, bit);
  }
  /// Bits that nothing is known about, the highest first.
  void PutPlain(std::uint32_t value, int bits) {
    while (bits-- > 0) Narrow(range_ >> 1, (value >> bits & 1) != 0);
  }
  /// All bytes. The decoder reads exactly as many.
  std::string Finish() {
    for (int i = 0; i < 5; ++i) ShiftLow();
    return std::move(bytes_);
  }

 private:
  void Narrow(std::uint32_t bound, bool bit) {
    if (bit) {
      range_ = bound;
    } else {
      low_ += bound;
      range_ -= bound;
    }
    while (range_ < std::uint32_t{1} << 24) {
      range_ <<= 8;
      ShiftLow();
    }
  }
  // The highest byte goes out as soon as no carry can change it.
  void ShiftLow() {
    if (low_ < 0xff000000u || low_ > 0xffffffffu) {
      const auto carry = static_cast<std::uint8_t>(low_ >> 32);
      for (; pending_ > 0; --pending_) {
        bytes_ += static_cast<char>(cache_ + carry);
        cache_ = 0xff;
      }
      cache_ = static_cast<std::uint8_t>(low_ >> 24);
    }
    ++pending_;
    low_ = (low_ & 0x00ffffffu) << 8;
  }

  std::string bytes_;
  std::uint64_t low_ = 0, pending_ = 1;
  std::uint32_t range_ = 0xffffffffu;
  std::uint8_t cache_ = 0;
};

}  // namespace dtr::pipeline
