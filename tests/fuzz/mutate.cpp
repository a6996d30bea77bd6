#include "tests/fuzz/mutate.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <span>

namespace dtr::fuzz {
namespace {

size_t Below(Random& random, size_t count) {
  return count == 0 ? 0 : static_cast<size_t>(random.Bits() % count);
}

// Where sizes and counts go wrong: ends of types, one off, and what multiplies to beyond them.
std::uint64_t HostileNumber(const std::string& text, Random& random) {
  const std::uint64_t size = text.size();
  const std::array<std::uint64_t, 18> numbers{
      0,          1,          0x7f,       0x80,       0xff,       0x7fff,
      0x8000,     0xffff,     0x10000,    0x7fffffff, 0x80000000, 0xffffffff,
      0x55555556, 1ull << 32, 1ull << 61, 1ull << 63, ~0ull,      size};
  return numbers[Below(random, numbers.size())] +
         (Below(random, 4) == 0 ? Below(random, 5) - 2 : 0);
}

void PutNumber(std::string& text, Random& random) {
  const size_t width = size_t{1} << Below(random, 4);
  if (text.size() < width) return;
  const size_t at = Below(random, text.size() - width + 1);
  const std::uint64_t number = HostileNumber(text, random);
  const bool big_endian = Below(random, 2) == 1;
  for (size_t i = 0; i < width; ++i) {
    text[at + (big_endian ? width - 1 - i : i)] = static_cast<char>(number >> (8 * i));
  }
}

void PutWord(std::string& text, Random& random) {
  static constexpr std::array<const char*, 24> kWords{
      "0",      "-1",         "1",     "nan",   "inf",  "-inf", "1e308",    "-1e308",
      "1e-320", "1e39",       "65536", "0.5",   "null", "true", "[]",       "{}",
      "\"\"",   "2147483648", "-0",    "1e400", "1e-9", "..",   "\"/etc\"", "18446744073709551616"};
  // A number that stands there, else anywhere.
  const size_t start = Below(random, text.size() + 1);
  const auto is_number = [](char c) {
    return std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-' || c == 'e';
  };
  size_t from = start;
  while (from < text.size() && std::isdigit(static_cast<unsigned char>(text[from])) == 0) ++from;
  size_t to = from;
  while (to < text.size() && is_number(text[to])) ++to;
  if (from >= text.size()) from = to = start;
  text.replace(from, to - from, kWords[Below(random, kWords.size())]);
}

// A piece of a text: short ones mostly, lines of it at times.
struct Piece {
  size_t at = 0, length = 0;
};

Piece SomePiece(const std::string& text, Random& random) {
  if (text.empty()) return {};
  Piece piece{Below(random, text.size()), 1 + Below(random, size_t{1} << Below(random, 11))};
  if (Below(random, 3) == 0) {
    const size_t line = text.rfind('\n', piece.at);
    piece.at = line == std::string::npos ? 0 : line + 1;
    const size_t end = text.find('\n', piece.at);
    piece.length = (end == std::string::npos ? text.size() : end + 1) - piece.at;
  }
  piece.length = std::min(piece.length, text.size() - piece.at);
  return piece;
}

void ChangeOnce(std::string& text, const std::vector<std::string>& corpus, Random& random) {
  const Piece piece = SomePiece(text, random);
  switch (Below(random, 10)) {
    case 0:
      if (!text.empty())
        text[piece.at] = static_cast<char>(text[piece.at] ^ (1 << Below(random, 8)));
      break;
    case 1:
      if (!text.empty()) text[piece.at] = static_cast<char>(random.Bits());
      break;
    case 2:
    case 3:
      PutNumber(text, random);
      break;
    case 4:
    case 5:
      PutWord(text, random);
      break;
    case 6:
      text.erase(piece.at, piece.length);
      break;
    case 7:
      text.insert(Below(random, text.size() + 1), text.substr(piece.at, piece.length));
      break;
    case 8: {
      const std::string& other = corpus[Below(random, corpus.size())];
      const Piece theirs = SomePiece(other, random);
      text.replace(piece.at, Below(random, 2) * piece.length, other, theirs.at, theirs.length);
      break;
    }
    default:
      if (Below(random, 4) == 0) text.resize(Below(random, text.size() + 1));
      break;
  }
}

}  // namespace

std::string Mutated(const std::vector<std::string>& corpus, Random& random, size_t limit_bytes) {
  std::string text = corpus[Below(random, corpus.size())];
  const size_t changes = size_t{1} << Below(random, 4);
  for (size_t i = 0; i < changes; ++i) ChangeOnce(text, corpus, random);
  if (text.size() > limit_bytes) text.resize(limit_bytes);
  return text;
}

}  // namespace dtr::fuzz
