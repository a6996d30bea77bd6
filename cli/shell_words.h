// cli/shell_words.h -- command lines that can be pasted into a shell.
#pragma once
#include <span>
#include <string>

namespace dtr::cli {

/// The words with spaces between them, quoted as a POSIX shell needs it: it gives the same words.
std::string ShellLine(std::span<const std::string> words);

}  // namespace dtr::cli
