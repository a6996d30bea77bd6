// capture/names.h -- internal to capture: names of files as texts.
#pragma once
#include <string>

namespace dtr::capture {

bool IsControl(char c);
/// A text that prints as one line and that JSON can hold.
std::string Printable(std::string text);
/// The same for a name, which is never empty.
std::string PrintableName(const std::string& name);
/// "a/b.jpg" -> "a/b"
std::string StemOf(const std::string& name);

}  // namespace dtr::capture
