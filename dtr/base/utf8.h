// dtr/base/utf8.h -- texts that JSON can hold, and that look like what they are.
#pragma once
#include <string>

namespace dtr {

/// True when `text` is well-formed UTF-8 (Unicode 15, table 3-7).
bool IsUtf8(const std::string& text);

/// For people: every character that turns the direction of writing (Unicode's bidirectional
/// overrides and isolates, with which a name can look like another) as U+FFFD.
std::string WithoutDirectionMarks(std::string text);

}  // namespace dtr
