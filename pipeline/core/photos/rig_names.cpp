#include "pipeline/core/photos/rig_names.h"

#include <charconv>
#include <filesystem>
#include <numeric>

namespace dtr::pipeline {

std::string DigitsAtEnd(const std::string& name) {
  size_t at = name.size();
  while (at > 0 && name[at - 1] >= '0' && name[at - 1] <= '9') --at;
  return name.substr(at);
}

std::optional<RigName> RigNameOf(const std::string& name) {
  const std::filesystem::path path(name);
  const std::string stem = path.stem().string();
  if (path.has_parent_path()) return RigName{path.parent_path().generic_string(), stem};
  const std::string digits = DigitsAtEnd(stem);
  if (digits.empty() || digits.size() == stem.size()) return std::nullopt;
  return RigName{stem.substr(0, stem.size() - digits.size()), digits};
}

std::vector<size_t> FrameTimes(const std::vector<std::string>& names) {
  std::vector<size_t> places(names.size());
  std::iota(places.begin(), places.end(), size_t{0});
  std::vector<size_t> numbers;
  std::string words;
  for (const std::string& name : names) {
    const std::string digits = DigitsAtEnd(name);
    const std::string before = name.substr(0, name.size() - digits.size());
    if (numbers.empty()) words = before;
    size_t number = 0;
    const auto [end, failure] =
        std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (failure != std::errc() || before != words) return places;
    if (!numbers.empty() && number <= numbers.back()) return places;
    numbers.push_back(number);
  }
  if (numbers.size() < 2) return places;
  size_t step = 0;
  for (const size_t number : numbers) step = std::gcd(step, number - numbers.front());
  constexpr size_t kMaxGaps = 100;
  if ((numbers.back() - numbers.front()) / step > kMaxGaps * names.size()) return places;
  for (size_t i = 0; i < numbers.size(); ++i) places[i] = (numbers[i] - numbers.front()) / step;
  return places;
}

}  // namespace dtr::pipeline
