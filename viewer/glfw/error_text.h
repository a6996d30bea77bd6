// viewer/glfw/error_text.h -- what went wrong, in a line for the window. The window outlives all of
// it.
#pragma once
#include <exception>
#include <string>

namespace dtr::viewer {

/// Of any exception: ours, the standard library's (file systems), want of memory.
std::string Said(const std::exception& error);

}  // namespace dtr::viewer
