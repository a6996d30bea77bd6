#include "dtr/types/photo_names.h"

#include "dtr/types/view.h"

namespace dtr {

std::vector<size_t> PhotosCalled(std::span<const std::string> names, const std::string& word) {
  std::vector<size_t> called;
  for (size_t i = 0; i < names.size(); ++i) {
    if (names[i] == word) return {i};
    if (IsCalled(names[i], word)) called.push_back(i);
  }
  return called;
}

}  // namespace dtr
