// Entropy-coded blocks of LZFSE: bytes to copy, and triplets of how many of them to copy, how many
// earlier ones to repeat and from how far back. Numbers are coded by tabled asymmetric numeral
// systems (J. Duda, arXiv:1311.2540); their bits are read from the end of a payload to its front.
#include <algorithm>
#include <array>
#include <bit>
#include <span>
#include <vector>

#include "dtr/io/formats/lzfse_parts.h"

namespace dtr::io::internal {
namespace {

constexpr size_t kLengths = 20, kDistances = 64, kByteValues = 256;
constexpr unsigned kLengthStates = 64, kDistanceStates = 256, kByteStates = 1024;
constexpr size_t kMaxBytes = 40000, kMaxTriplets = 10000;  // of a block
constexpr size_t kStreams = 4;                             // in which bytes are interleaved

/// How often symbols occur, of all states of their table.
struct Frequencies {
  std::array<unsigned, kLengths> copied{}, repeated{};
  std::array<unsigned, kDistances> distance{};
  std::array<unsigned, kByteValues> byte{};

  template <typename Read>
  void ForEach(Read read) {
    for (unsigned& frequency : copied) frequency = read();
    for (unsigned& frequency : repeated) frequency = read();
    for (unsigned& frequency : distance) frequency = read();
    for (unsigned& frequency : byte) frequency = read();
  }
};

struct BlockHeader {
  size_t stands_for = 0;  ///< bytes
  size_t bytes = 0, byte_payload = 0, triplets = 0, triplet_payload = 0;
  unsigned byte_unused_bits = 0, triplet_unused_bits = 0;  ///< at the end of the payloads
  std::array<unsigned, kStreams> byte_states{};
  unsigned copied_state = 0, repeated_state = 0, distance_state = 0;
  Frequencies frequencies;
};

/// Numbers of few bits in their order, the lowest bits of a byte first.
class ForwardBits {
 public:
  explicit ForwardBits(std::string_view bytes) : bytes_(bytes) {}
  unsigned Take(unsigned count) {
    unsigned number = 0;
    for (unsigned i = 0; i < count; ++i, ++next_) {
      if (next_ / 8 >= bytes_.size()) throw LzfseFault{"its end before that of a block"};
      number |= (static_cast<unsigned char>(bytes_[next_ / 8]) >> next_ % 8 & 1u) << i;
    }
    return number;
  }
  bool UsesAllBytes() const { return (next_ + 7) / 8 == bytes_.size(); }

 private:
  std::string_view bytes_;
  size_t next_ = 0;
};

/// A frequency in the short form: small ones have few bits.
unsigned PackedFrequency(ForwardBits& bits) {
  if (bits.Take(1) == 0) return bits.Take(1);
  if (bits.Take(1) == 0) return 2 + bits.Take(1);
  if (bits.Take(1) == 0) return 4 + bits.Take(2);
  return bits.Take(1) == 0 ? 8 + bits.Take(4) : 24 + bits.Take(10);
}

/// Numbers of a 64-bit word, from its lowest bit on.
class PackedWord {
 public:
  explicit PackedWord(std::uint64_t word) : word_(word) {}
  unsigned Take(unsigned bits) {
    const auto number = static_cast<unsigned>(word_ & ((std::uint64_t{1} << bits) - 1));
    word_ >>= bits;
    return number;
  }

 private:
  std::uint64_t word_;
};

constexpr unsigned kBitsOfAByte = 8;

/// From the bits of the last byte that count less 8, 0 meaning all of them.
unsigned UnusedBits(std::uint64_t stored) {
  const auto unused = static_cast<unsigned>(-static_cast<std::int32_t>(stored));
  if (unused >= kBitsOfAByte) throw LzfseFault{"a header that cannot be"};
  return unused;
}

BlockHeader PackedHeader(LzfseBytes& stream) {
  constexpr size_t kFixedBytes = 32;  // the mark among them
  BlockHeader header;
  header.stands_for = static_cast<size_t>(stream.Number(4));
  PackedWord sizes(stream.Number(8)), states(stream.Number(8)), last(stream.Number(8));
  header.bytes = sizes.Take(20);
  header.byte_payload = sizes.Take(20);
  header.triplets = sizes.Take(20);
  header.byte_unused_bits = kBitsOfAByte - 1 - sizes.Take(3);
  for (unsigned& state : header.byte_states) state = states.Take(10);
  header.triplet_payload = states.Take(20);
  header.triplet_unused_bits = kBitsOfAByte - 1 - states.Take(3);
  const size_t header_bytes = last.Take(32);
  header.copied_state = last.Take(10);
  header.repeated_state = last.Take(10);
  header.distance_state = last.Take(10);
  if (header_bytes < kFixedBytes) throw LzfseFault{"a header that cannot be"};
  if (header_bytes == kFixedBytes) return header;  // without frequencies: nothing is coded
  ForwardBits bits(stream.Take(header_bytes - kFixedBytes));
  header.frequencies.ForEach([&] { return PackedFrequency(bits); });
  if (!bits.UsesAllBytes()) throw LzfseFault{"a header that cannot be"};
  return header;
}

BlockHeader PlainHeader(LzfseBytes& stream) {
  const auto number = [&](size_t bytes) { return static_cast<size_t>(stream.Number(bytes)); };
  BlockHeader header;
  header.stands_for = number(4);
  number(4);  // both payloads together
  header.bytes = number(4);
  header.triplets = number(4);
  header.byte_payload = number(4);
  header.triplet_payload = number(4);
  header.byte_unused_bits = UnusedBits(stream.Number(4));
  for (unsigned& state : header.byte_states) state = static_cast<unsigned>(number(2));
  header.triplet_unused_bits = UnusedBits(stream.Number(4));
  header.copied_state = static_cast<unsigned>(number(2));
  header.repeated_state = static_cast<unsigned>(number(2));
  header.distance_state = static_cast<unsigned>(number(2));
  header.frequencies.ForEach([&] { return static_cast<unsigned>(number(2)); });
  number(2);  // up to a multiple of 4
  return header;
}

/// Numbers of few bits from the end of a payload to its front.
class BackwardBits {
 public:
  BackwardBits(std::string_view bytes, unsigned unused)
      : bytes_(bytes), left_(kBitsOfAByte * bytes.size()) {
    if (Take(unused) != 0) throw LzfseFault{"bits that should be 0"};
  }
  unsigned Take(unsigned count) {
    if (count > left_) throw LzfseFault{"too few bits in a block"};
    unsigned number = 0;
    while (count > 0) {
      // What is left of the last byte, or the upper part of that.
      const auto in_byte = static_cast<unsigned>((left_ - 1) % kBitsOfAByte) + 1;
      const unsigned taken = std::min(count, in_byte);
      const unsigned byte = static_cast<unsigned char>(bytes_[(left_ - 1) / kBitsOfAByte]);
      number = number << taken | (byte >> (in_byte - taken) & ((1u << taken) - 1));
      left_ -= taken;
      count -= taken;
    }
    return number;
  }

 private:
  std::string_view bytes_;
  size_t left_;
};

/// Symbols out of states: each state stands for a symbol and, with some bits more, for the next
/// state.
class SymbolTable {
 public:
  /// A symbol of frequency f has f states in a row; the i-th of them, with f + i in the role of
  /// Duda's x, takes as many bits as bring that to at least the number of states.
  SymbolTable(std::span<const unsigned> frequencies, unsigned states) {
    unsigned sum = 0;
    for (const unsigned frequency : frequencies) sum += frequency;
    if (sum > states) throw LzfseFault{"frequencies that add up to too much"};
    entries_.reserve(states);
    for (size_t symbol = 0; symbol < frequencies.size(); ++symbol) {
      for (unsigned x = frequencies[symbol]; x < 2 * frequencies[symbol]; ++x) {
        const auto bits = static_cast<unsigned>(std::bit_width(states) - std::bit_width(x));
        entries_.push_back({static_cast<unsigned>(symbol), bits, (x << bits) - states});
      }
    }
  }
  /// The symbol of `state`, which becomes the next one.
  unsigned Next(unsigned& state, BackwardBits& bits) const {
    if (state >= entries_.size()) throw LzfseFault{"a state without a symbol"};
    const Entry& entry = entries_[state];
    state = entry.next + bits.Take(entry.bits);
    return entry.symbol;
  }

 private:
  struct Entry {
    unsigned symbol, bits, next;
  };
  std::vector<Entry> entries_;
};

/// Numbers out of symbols: a symbol says the number but for some lowest bits, which follow. Each
/// begins where the one before it ends.
class NumberTable {
 public:
  NumberTable(std::span<const unsigned> frequencies, unsigned states,
              std::span<const unsigned> extra_bits)
      : symbols_(frequencies, states), extra_bits_(extra_bits) {
    unsigned first = 0;
    for (const unsigned bits : extra_bits) {
      firsts_.push_back(first);
      first += 1u << bits;
    }
  }
  size_t Next(unsigned& state, BackwardBits& bits) const {
    const unsigned symbol = symbols_.Next(state, bits);
    return firsts_[symbol] + bits.Take(extra_bits_[symbol]);
  }

 private:
  SymbolTable symbols_;
  std::span<const unsigned> extra_bits_;
  std::vector<unsigned> firsts_;
};

/// 0 to 15 each have a symbol, larger ones share four.
std::array<unsigned, kLengths> ExtraBitsOfLengths(const std::array<unsigned, 4>& last) {
  std::array<unsigned, kLengths> bits{};
  std::copy(last.begin(), last.end(), bits.end() - 4);
  return bits;
}

/// Four symbols for each number of bits.
std::array<unsigned, kDistances> ExtraBitsOfDistances() {
  std::array<unsigned, kDistances> bits{};
  for (unsigned i = 0; i < kDistances; ++i) bits[i] = i / 4;
  return bits;
}

std::string BytesOf(const BlockHeader& header, std::string_view payload) {
  const SymbolTable table(header.frequencies.byte, kByteStates);
  BackwardBits bits(payload, header.byte_unused_bits);
  std::array<unsigned, kStreams> states = header.byte_states;
  std::string bytes(header.bytes, '\0');
  for (size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<char>(table.Next(states[i % kStreams], bits));
  }
  return bytes;
}

void Execute(const BlockHeader& header, std::string_view payload, std::string_view to_copy,
             LzfseOutput& output) {
  const auto copied_bits = ExtraBitsOfLengths({2, 3, 5, 8});
  const auto repeated_bits = ExtraBitsOfLengths({3, 5, 8, 11});
  const auto distance_bits = ExtraBitsOfDistances();
  const NumberTable copied(header.frequencies.copied, kLengthStates, copied_bits);
  const NumberTable repeated(header.frequencies.repeated, kLengthStates, repeated_bits);
  const NumberTable distances(header.frequencies.distance, kDistanceStates, distance_bits);
  BackwardBits bits(payload, header.triplet_unused_bits);
  unsigned copied_state = header.copied_state, repeated_state = header.repeated_state,
           distance_state = header.distance_state;
  LzfseBytes source(to_copy);
  size_t distance = 0;
  for (size_t i = 0; i < header.triplets; ++i) {
    output.Append(source.Take(copied.Next(copied_state, bits)));
    const size_t length = repeated.Next(repeated_state, bits);
    const size_t own_distance = distances.Next(distance_state, bits);
    if (own_distance > 0) distance = own_distance;  // 0: as far back as before
    output.Repeat(distance, length);
  }
}

}  // namespace

void DecodeEntropyBlock(LzfseBytes& stream, bool packed, LzfseOutput& output) {
  const BlockHeader header = packed ? PackedHeader(stream) : PlainHeader(stream);
  if (header.bytes > kMaxBytes || header.bytes % kStreams != 0 || header.triplets > kMaxTriplets) {
    throw LzfseFault{"a header that cannot be"};
  }
  const size_t before = output.size();
  const std::string bytes = BytesOf(header, stream.Take(header.byte_payload));
  Execute(header, stream.Take(header.triplet_payload), bytes, output);
  if (output.size() - before != header.stands_for) throw LzfseFault{"a block of another length"};
}

}  // namespace dtr::io::internal
