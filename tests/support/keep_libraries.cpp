// In programs under a sanitizer, libraries that were loaded while they run stay loaded. A driver
// that is gone by the end takes the pointers to what it still holds with it: the leak detector
// reports that memory, and cannot name whose it was.
#include <dlfcn.h>

extern "C" int dlclose(void* /*handle*/) noexcept { return 0; }
