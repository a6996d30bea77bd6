// Loaded into a program under test before all other libraries (LD_PRELOAD): calls of the system
// that fail, or that the program does not survive.
//   DTR_TEST_THREADS=N     of the threads that are started after main() began, N can be
//   DTR_TEST_KILLED_AT=N   it is killed before the Nth call that renames or deletes
#include <dlfcn.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>

namespace {

int Number(const char* variable) {
  const char* text = getenv(variable);
  return text == nullptr ? -1 : atoi(text);
}

// Libraries that the program is linked with, and those of images, which are loaded with this one,
// have started their threads by now: some end the program where they cannot.
std::atomic<int> threads_left = -1, calls_left = -1;
__attribute__((constructor)) void ReadEnvironment() {
  threads_left = Number("DTR_TEST_THREADS");
  calls_left = Number("DTR_TEST_KILLED_AT");
}

void CountCall() {
  if (calls_left > 0 && --calls_left == 0) kill(getpid(), SIGKILL);
}

template <typename Function>
Function* Real(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*start)(void*),
                   void* argument) {
  if (threads_left == 0) return EAGAIN;
  if (threads_left > 0) --threads_left;
  return Real<decltype(pthread_create)>("pthread_create")(thread, attributes, start, argument);
}

int rename(const char* from, const char* to) noexcept {
  CountCall();
  return Real<int(const char*, const char*)>("rename")(from, to);
}

int renameat2(int from_folder, const char* from, int to_folder, const char* to,
              unsigned flags) noexcept {
  CountCall();
  return Real<int(int, const char*, int, const char*, unsigned)>("renameat2")(from_folder, from,
                                                                              to_folder, to, flags);
}

int renameat(int from_folder, const char* from, int to_folder, const char* to) noexcept {
  CountCall();
  return Real<int(int, const char*, int, const char*)>("renameat")(from_folder, from, to_folder,
                                                                   to);
}

int unlink(const char* file) noexcept {
  CountCall();
  return Real<int(const char*)>("unlink")(file);
}

int unlinkat(int folder, const char* file, int flags) noexcept {
  CountCall();
  return Real<int(int, const char*, int)>("unlinkat")(folder, file, flags);
}

int remove(const char* file) noexcept {
  CountCall();
  return Real<int(const char*)>("remove")(file);
}

int rmdir(const char* folder) noexcept {
  CountCall();
  return Real<int(const char*)>("rmdir")(folder);
}

}  // extern "C"
