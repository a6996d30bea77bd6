// dtr/base/file_names.h -- file names that come from files.
#pragma once
#include <string>

namespace dtr {

/// Empty when `name` is a relative path that stays inside its folder and prints as one line; else
/// what is wrong with it ("is absolute", ...). Sub-folders ("left/0001.jpg") are fine.
std::string WhyUnsafeName(const std::string& name);

/// Throws Error "where: ..." unless WhyUnsafeName(name) is empty.
void RequireSafeName(const std::string& name, const std::string& where);

/// The beginning of a text out of a file, fit for a message of one line.
std::string Printable(const std::string& text);

}  // namespace dtr
