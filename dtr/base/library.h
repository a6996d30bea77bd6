// dtr/base/library.h -- shared libraries that are loaded when they are needed.
#pragma once
#include <string>

namespace dtr {

/// The address of a function of a shared library, which is loaded where it is not yet, and never
/// unloaded. It is found as the libraries are that the program links. Throws Error, which begins
/// with `cannot`, where there is none. From any thread.
void* FunctionOfLibrary(const char* library, const char* function, const std::string& cannot);

}  // namespace dtr
