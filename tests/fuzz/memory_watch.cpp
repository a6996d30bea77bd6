#include "tests/fuzz/memory_watch.h"

#include <malloc.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define DTR_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define DTR_SANITIZED 1
#endif
#endif

namespace dtr::fuzz {
namespace {

std::atomic<long> held_bytes{0};
std::atomic<long> peak_bytes{0};

void Add(long bytes) {
  const long now = held_bytes.fetch_add(bytes, std::memory_order_relaxed) + bytes;
  long peak = peak_bytes.load(std::memory_order_relaxed);
  while (now > peak && !peak_bytes.compare_exchange_weak(peak, now, std::memory_order_relaxed)) {
  }
}

}  // namespace
}  // namespace dtr::fuzz

#ifdef DTR_SANITIZED
// A sanitizer has an allocator of its own and tells of every call. GCC has these functions, too,
// but not the header, sanitizer/allocator_interface.h, that declares them.
extern "C" {
int __sanitizer_install_malloc_and_free_hooks(void (*on_malloc)(const volatile void*, size_t),
                                              void (*on_free)(const volatile void*));
size_t __sanitizer_get_allocated_size(const volatile void* block);
}
namespace dtr::fuzz {
namespace {
[[maybe_unused]] const int hooked = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void*, size_t bytes) { Add(static_cast<long>(bytes)); },
    [](const volatile void* block) {
      if (block == nullptr) return;
      Add(-static_cast<long>(__sanitizer_get_allocated_size(block)));
    });
}  // namespace
}  // namespace dtr::fuzz
#else
// The C library's functions under its own second names; what the program defines takes their place
// in all libraries (glibc manual, "Replacing malloc").
extern "C" {
void* __libc_malloc(size_t bytes);
void* __libc_calloc(size_t count, size_t bytes);
void* __libc_realloc(void* block, size_t bytes);
void* __libc_memalign(size_t align, size_t bytes);
void __libc_free(void* block);

static void* Counted(void* block) {
  if (block != nullptr) dtr::fuzz::Add(static_cast<long>(malloc_usable_size(block)));
  return block;
}
static void Uncount(void* block) {
  if (block != nullptr) dtr::fuzz::Add(-static_cast<long>(malloc_usable_size(block)));
}

void* malloc(size_t bytes) { return Counted(__libc_malloc(bytes)); }
void* calloc(size_t count, size_t bytes) { return Counted(__libc_calloc(count, bytes)); }
void* realloc(void* block, size_t bytes) {
  Uncount(block);
  void* const moved = __libc_realloc(block, bytes);
  if (moved == nullptr && bytes != 0) return Counted(block), nullptr;  // the old one stays
  return Counted(moved);
}
void* memalign(size_t align, size_t bytes) { return Counted(__libc_memalign(align, bytes)); }
void* aligned_alloc(size_t align, size_t bytes) { return memalign(align, bytes); }
int posix_memalign(void** out, size_t align, size_t bytes) {
  void* const block = memalign(align, bytes);
  if (block == nullptr) return ENOMEM;
  *out = block;
  return 0;
}
void free(void* block) {
  Uncount(block);
  __libc_free(block);
}
}
#endif

namespace dtr::fuzz {

MemoryWatch::MemoryWatch() : start_bytes_(held_bytes.load()) { peak_bytes.store(start_bytes_); }

long MemoryWatch::PeakBytes() const { return peak_bytes.load() - start_bytes_; }

}  // namespace dtr::fuzz
