#include "cli/arguments.h"

#include <fmt/format.h>

#include <algorithm>

#include "dtr/base/error.h"
#include "dtr/base/utf8.h"

namespace dtr::cli {

void RequirePlainArguments(const std::vector<std::string>& arguments) {
  for (size_t i = 0; i < arguments.size(); ++i) {
    std::string shown = arguments[i];
    const bool control = std::any_of(shown.begin(), shown.end(), [](char c) {
      return static_cast<unsigned char>(c) < ' ' || c == '\x7f';
    });
    const bool utf8 = IsUtf8(shown);
    if (utf8 && !control) continue;
    for (char& c : shown) c = c >= ' ' && c <= '~' ? c : '?';  // for any terminal
    throw UsageError(fmt::format("argument {}: expected {}, found '{}'; rename the file or folder",
                                 i + 1, utf8 ? "no control characters" : "UTF-8", shown));
  }
}

}  // namespace dtr::cli
