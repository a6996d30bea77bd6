#include "dtr/io/formats/lzfse.h"

#include "dtr/base/error.h"
#include "dtr/io/formats/lzfse_parts.h"

namespace dtr::io {
namespace internal {

// Instructions of one byte, with what they need behind it. Most copy up to three bytes as they are
// (LL), then repeat earlier ones (MMM + 3 of them, DDD and more bits for how far back):
//   LLMMMDDD d     near     LLMMM111 dd    far     LLMMM110    as far back as before
//   101LLMMM dddddd MM d    medium         1110LLLL    bytes alone    1111MMMM    repeat alone
void DecodeLzvn(std::string_view payload, LzfseOutput& output) {
  constexpr size_t kEndBytes = 7, kShortestRepeat = 3, kLongCount = 16;
  LzfseBytes bytes(payload);
  size_t distance = 0;
  for (;;) {
    const auto code = static_cast<unsigned>(bytes.Number(1));
    const unsigned family = code >> 4, low = code & 7;
    const unsigned counted = code & 15;
    if (family == 0xe) {
      output.Append(bytes.Take(counted > 0 ? counted : kLongCount + bytes.Number(1)));
      continue;
    }
    if (family == 0xf) {
      output.Repeat(distance, counted > 0 ? counted : kLongCount + bytes.Number(1));
      continue;
    }
    if (family == 0xa || family == 0xb) {
      const auto more = static_cast<size_t>(bytes.Number(2));
      distance = more >> 2;
      output.Append(bytes.Take(code >> 3 & 3));
      output.Repeat(distance, (low << 2 | (more & 3)) + kShortestRepeat);
      continue;
    }
    if (family == 0x7 || family == 0xd) throw LzfseFault{"an unknown instruction"};
    if (low == 6 && code < 0x40) {  // with nothing to copy these are no repeats
      if (code == 0x0e || code == 0x16) continue;
      if (code != 0x06) throw LzfseFault{"an unknown instruction"};
      bytes.Take(kEndBytes);
      if (!bytes.empty()) throw LzfseFault{"bytes behind the end of a block"};
      return;
    }
    if (low == 7) {
      distance = static_cast<size_t>(bytes.Number(2));
    } else if (low < 6) {
      distance = low << 8 | static_cast<size_t>(bytes.Number(1));
    }
    output.Append(bytes.Take(code >> 6));
    output.Repeat(distance, (code >> 3 & 7) + kShortestRepeat);
  }
}

namespace {

void DecodeBlocks(std::string_view stream, LzfseOutput& output) {
  LzfseBytes bytes(stream);
  for (;;) {
    const std::string_view mark = bytes.Take(4);
    if (mark == "bvx$") return;
    if (mark == "bvx1" || mark == "bvx2") {
      DecodeEntropyBlock(bytes, mark == "bvx2", output);
    } else if (mark == "bvx-") {
      output.Append(bytes.Take(static_cast<size_t>(bytes.Number(4))));
    } else if (mark == "bvxn") {
      const size_t before = output.size(), stands_for = static_cast<size_t>(bytes.Number(4));
      DecodeLzvn(bytes.Take(static_cast<size_t>(bytes.Number(4))), output);
      if (output.size() - before != stands_for) throw LzfseFault{"a block of another length"};
    } else {
      throw LzfseFault{"an unknown kind of block"};
    }
  }
}

}  // namespace
}  // namespace internal

std::string DecodeLzfse(std::string_view stream, size_t max_bytes, const std::string& source) {
  internal::LzfseOutput output(max_bytes);
  try {
    internal::DecodeBlocks(stream, output);
  } catch (const internal::LzfseFault& fault) {
    throw Error(source + ": damaged LZFSE data: found " + fault.found + "; copy the file again");
  }
  return output.Take();
}

}  // namespace dtr::io
