// tests/fuzz/memory_watch.h -- how much is allocated at a time, by any library of the process.
#pragma once

namespace dtr::fuzz {

/// Counts from its construction on; one at a time.
class MemoryWatch {
 public:
  MemoryWatch();
  /// The most bytes held at a time since then, beyond those held then.
  long PeakBytes() const;

 private:
  long start_bytes_;
};

}  // namespace dtr::fuzz
