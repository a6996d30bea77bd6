// dtr/base/huge_pages.h -- memory for large tables that are read all over the place.
#pragma once
#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <new>
#include <vector>

namespace dtr {

/// Allocator of std::vector that asks the system for huge pages (2 MiB, Linux' madvise) where a
/// block fills at least half of one. A processor keeps some 2000 pages' addresses at hand; the
/// views of one image take 10000 of the usual 4 KiB, so every other look-up would wait for a
/// second one. Systems that give no huge pages give the usual ones.
template <typename T>
class HugePageAllocator {
 public:
  using value_type = T;
  HugePageAllocator() = default;
  template <typename U>
  HugePageAllocator(const HugePageAllocator<U>&) {}

  T* allocate(size_t count) {
    if (count > static_cast<size_t>(-1) / 2 / sizeof(T)) throw std::bad_array_new_length();
    const size_t bytes = count * sizeof(T);
    if (bytes < kPage / 2) return static_cast<T*>(::operator new(bytes));
    // A last page that would be less than half full stays one of small pages.
    const size_t huge = (bytes + kPage / 2) / kPage * kPage;
    void* block = std::aligned_alloc(kPage, (bytes + kPage - 1) / kPage * kPage);
    if (block == nullptr) throw std::bad_alloc();
    madvise(block, huge, MADV_HUGEPAGE);
    return static_cast<T*>(block);
  }
  void deallocate(T* block, size_t count) {
    count * sizeof(T) < kPage / 2 ? ::operator delete(block) : std::free(block);
  }
  friend bool operator==(const HugePageAllocator&, const HugePageAllocator&) { return true; }

 private:
  static constexpr size_t kPage = size_t{1} << 21;
};

template <typename T>
using HugeVector = std::vector<T, HugePageAllocator<T>>;

}  // namespace dtr
