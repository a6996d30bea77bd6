#include "dtr/base/library.h"

#include <dlfcn.h>

#include "dtr/base/error.h"

namespace dtr {

void* FunctionOfLibrary(const char* library, const char* function, const std::string& cannot) {
  void* const loaded = dlopen(library, RTLD_LAZY | RTLD_LOCAL);
  void* const found = loaded == nullptr ? nullptr : dlsym(loaded, function);
  if (found != nullptr) return found;
  throw Error(cannot + ", as a library cannot be loaded: " + dlerror() +
              "; install dtr again with the packages that it needs");
}

}  // namespace dtr
