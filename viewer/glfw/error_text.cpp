#include "viewer/glfw/error_text.h"

#include <filesystem>
#include <new>

namespace dtr::viewer {

std::string Said(const std::exception& error) {
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) {
    return "memory: expected enough for this, found too little; close other programs, or begin "
           "with a smaller --memory or --size";
  }
  if (const auto* of_files = dynamic_cast<const std::filesystem::filesystem_error*>(&error)) {
    return of_files->path1().string() +
           ": expected a folder or file that can be used, found: " + of_files->code().message();
  }
  return error.what();
}

}  // namespace dtr::viewer
