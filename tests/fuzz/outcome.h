// tests/fuzz/outcome.h -- what a reader must not do, whatever it is given.
#pragma once
#include <string>
#include <string_view>

#include "tests/fuzz/readers.h"

namespace dtr::fuzz {

/// CPU time that one input may take, s.
inline constexpr double kHangS = 1.0;
/// What may be allocated at a time while an input of `bytes` is read: 10 x + 64 MiB.
constexpr long AllowedBytes(size_t bytes) { return 10 * static_cast<long>(bytes) + (64L << 20); }

struct Outcome {
  bool accepted = false;   ///< the reader took the input for a good file
  std::string error_text;  ///< which rule was broken; empty: none
};

/// Writes the input to the reader's file and reads it. Rules: an Error of one line or none at all,
/// at most kHangS, at most AllowedBytes (and the reader's buffer_bytes). A crash is left to happen:
/// the file then holds the input.
Outcome TryInput(const Reader& reader, std::string_view input);

/// Fresh folder in memory where there is one (/dev/shm), else among the temporary files.
std::filesystem::path MakeFolder();

}  // namespace dtr::fuzz
