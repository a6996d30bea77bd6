// dtr/base/utf8.h -- texts that JSON can hold.
#pragma once
#include <string>

namespace dtr {

/// True when `text` is well-formed UTF-8 (Unicode 15, table 3-7).
bool IsUtf8(const std::string& text);

}  // namespace dtr
