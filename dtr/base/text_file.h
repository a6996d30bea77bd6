// dtr/base/text_file.h -- text that other programs and people wrote: bytes in, one form of text
// out.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace dtr {

/// The text that `bytes` are, in the one form that our readers know: UTF-8 without a byte order
/// mark, each line ended by '\n', the last one too. Converts UTF-16 that has a byte order mark, and
/// the line ends of Windows and old Macs. Throws Error "source: ..." where a byte is 0 (no text has one, UTF-16
/// without its mark has many) and where UTF-16 is cut or broken.
std::string TextOf(std::string bytes, const std::string& source);

/// TextOf the content of a file. Throws Error as ReadFile does, too.
std::string ReadTextFile(const std::filesystem::path& file, std::uintmax_t limit_bytes);

/// TextOf the beginning of a file, to see what it is: what UTF-16 lacks at the cut is left out,
/// bytes that are no text stay as they are.
std::string TextOfHead(std::string bytes);

/// A word that is one finite number, with '+' before it or not; empty for all others.
std::optional<double> FiniteNumber(std::string_view word);

/// A clause for the end of a message about a word that is no number: what to do where it has a
/// decimal comma ("1,5"), else "".
std::string DecimalCommaHint(std::string_view word);

}  // namespace dtr
