// A library for LD_PRELOAD: every call that makes, changes or removes a file or folder is written,
// as "CALL PATH", to the file that DTR_RECORD_FILES names. Programs that the recorded one starts
// are recorded too.
#include <dlfcn.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace {

template <typename Function>
Function* Next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

// By system calls alone: the functions of the library are recorded themselves.
void Record(const char* call, int folder, const char* path) {
  static const char* const log = getenv("DTR_RECORD_FILES");
  if (log == nullptr || path == nullptr) return;
  char before[4096] = "";
  if (path[0] != '/') {
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", folder);
    const ssize_t length = folder == AT_FDCWD
                               ? readlink("/proc/self/cwd", before, sizeof before - 2)
                               : readlink(link, before, sizeof before - 2);
    if (length > 0) before[length] = '/', before[length + 1] = '\0';
  }
  char line[8300];
  const int length = snprintf(line, sizeof line, "%s %s%s\n", call, before, path);
  const long fd =
      syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0666);
  if (fd < 0) return;
  syscall(SYS_write, fd, line, static_cast<size_t>(length));
  syscall(SYS_close, fd);
}

bool Writes(int flags) {
  return (flags & (O_CREAT | O_TRUNC)) != 0 || (flags & O_ACCMODE) != O_RDONLY;
}

mode_t ModeIn(int flags, va_list arguments) {
  return (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(arguments, mode_t) : 0;
}

}  // namespace

extern "C" {

#define DTR_OPEN(name)                                                 \
  int name(const char* path, int flags, ...) {                         \
    va_list arguments;                                                 \
    va_start(arguments, flags);                                        \
    const mode_t mode = ModeIn(flags, arguments);                      \
    va_end(arguments);                                                 \
    if (Writes(flags)) Record("open", AT_FDCWD, path);                 \
    return Next<int(const char*, int, ...)>(#name)(path, flags, mode); \
  }
DTR_OPEN(open)
DTR_OPEN(open64)

#define DTR_OPENAT(name)                                                            \
  int name(int folder, const char* path, int flags, ...) {                          \
    va_list arguments;                                                              \
    va_start(arguments, flags);                                                     \
    const mode_t mode = ModeIn(flags, arguments);                                   \
    va_end(arguments);                                                              \
    if (Writes(flags)) Record("open", folder, path);                                \
    return Next<int(int, const char*, int, ...)>(#name)(folder, path, flags, mode); \
  }
DTR_OPENAT(openat)
DTR_OPENAT(openat64)

#define DTR_FOPEN(name)                                                  \
  FILE* name(const char* path, const char* mode) {                       \
    if (strpbrk(mode, "wa+") != nullptr) Record("open", AT_FDCWD, path); \
    return Next<FILE*(const char*, const char*)>(#name)(path, mode);     \
  }
DTR_FOPEN(fopen)
DTR_FOPEN(fopen64)

// Calls whose first argument is the path that is changed.
#define DTR_CHANGE(result, name, parameters, ...)       \
  result name parameters {                              \
    Record(#name, AT_FDCWD, path);                      \
    return Next<result parameters>(#name)(__VA_ARGS__); \
  }
DTR_CHANGE(int, creat, (const char* path, mode_t mode), path, mode)
DTR_CHANGE(int, creat64, (const char* path, mode_t mode), path, mode)
DTR_CHANGE(int, unlink, (const char* path), path)
DTR_CHANGE(int, remove, (const char* path), path)
DTR_CHANGE(int, rmdir, (const char* path), path)
DTR_CHANGE(int, mkdir, (const char* path, mode_t mode), path, mode)
DTR_CHANGE(int, mkfifo, (const char* path, mode_t mode), path, mode)
DTR_CHANGE(int, truncate, (const char* path, off_t size), path, size)
DTR_CHANGE(int, truncate64, (const char* path, off64_t size), path, size)
DTR_CHANGE(int, chmod, (const char* path, mode_t mode), path, mode)
DTR_CHANGE(int, chown, (const char* path, uid_t user, gid_t group), path, user, group)
DTR_CHANGE(char*, mkdtemp, (char* path), path)
DTR_CHANGE(int, mkstemp, (char* path), path)
DTR_CHANGE(int, mkstemp64, (char* path), path)

int rename(const char* from, const char* to) {
  Record("rename", AT_FDCWD, from);
  Record("rename", AT_FDCWD, to);
  return Next<int(const char*, const char*)>("rename")(from, to);
}
int renameat(int from_folder, const char* from, int to_folder, const char* to) {
  Record("rename", from_folder, from);
  Record("rename", to_folder, to);
  return Next<int(int, const char*, int, const char*)>("renameat")(from_folder, from, to_folder,
                                                                   to);
}
int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) {
  Record("rename", from_folder, from);
  Record("rename", to_folder, to);
  return Next<int(int, const char*, int, const char*, unsigned)>("renameat2")(from_folder, from,
                                                                              to_folder, to, flags);
}
int link(const char* from, const char* to) {
  Record("link", AT_FDCWD, to);
  return Next<int(const char*, const char*)>("link")(from, to);
}
int symlink(const char* from, const char* to) {
  Record("symlink", AT_FDCWD, to);
  return Next<int(const char*, const char*)>("symlink")(from, to);
}
int unlinkat(int folder, const char* path, int flags) {
  Record("unlinkat", folder, path);
  return Next<int(int, const char*, int)>("unlinkat")(folder, path, flags);
}
int mkdirat(int folder, const char* path, mode_t mode) {
  Record("mkdirat", folder, path);
  return Next<int(int, const char*, mode_t)>("mkdirat")(folder, path, mode);
}
int fchmodat(int folder, const char* path, mode_t mode, int flags) {
  Record("fchmodat", folder, path);
  return Next<int(int, const char*, mode_t, int)>("fchmodat")(folder, path, mode, flags);
}
int utimensat(int folder, const char* path, const timespec times[2], int flags) {
  Record("utimensat", folder, path);
  return Next<int(int, const char*, const timespec*, int)>("utimensat")(folder, path, times, flags);
}

}  // extern "C"
