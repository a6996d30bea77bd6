// dtr/base/part.h -- one of several equal parts of a list, each worked on by a process of its own.
#pragma once
#include <cstddef>

namespace dtr {

/// Part `index` of `count`, from 0; with a count of 0 it has nothing of any list.
struct Part {
  int index = 0, count = 1;

  /// First item of the part in a list of `items`, and the one after its last. The parts of a list
  /// follow each other and differ by at most one item; of more parts than items some are empty.
  std::size_t Begin(std::size_t items) const { return Share(index, items); }
  std::size_t End(std::size_t items) const { return Share(index + 1, items); }
  bool Has(std::size_t item, std::size_t items) const {
    return item >= Begin(items) && item < End(items);
  }

 private:
  std::size_t Share(int parts, std::size_t items) const {
    if (count < 1) return 0;
    return items * static_cast<std::size_t>(parts) / static_cast<std::size_t>(count);
  }
};

}  // namespace dtr
