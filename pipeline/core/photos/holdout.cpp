#include "pipeline/core/photos/holdout.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <sstream>

#include "dtr/base/error.h"
#include "dtr/types/view.h"

namespace dtr::pipeline {
namespace {

constexpr std::string_view kEvery = "every:";

int ParseEvery(const std::string& spec) {
  const std::string digits = spec.substr(kEvery.size());
  int n = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), n);
  if (error != std::errc() || end != digits.data() + digits.size() || n < 2) {
    throw UsageError(fmt::format(
        "`holdout` {}: expected every:N with a whole number N >= 2, found '{}'", spec, digits));
  }
  return n;
}

void MarkNamed(const std::string& spec, std::span<const std::string> names,
               std::vector<bool>& held_out) {
  std::istringstream list(spec);
  for (std::string wanted; std::getline(list, wanted, ',');) {
    bool found = false;
    for (size_t i = 0; i < names.size(); ++i) {
      if (!IsCalled(names[i], wanted)) continue;
      held_out[i] = found = true;
    }
    if (!found) {
      throw UsageError(fmt::format("`holdout`: no photo is named '{}'; the first is '{}'", wanted,
                                   names.empty() ? "" : names.front()));
    }
  }
}

}  // namespace

bool IsNamed(const std::string& spec, const std::string& name) {
  std::istringstream list(spec);
  for (std::string wanted; std::getline(list, wanted, ',');) {
    if (IsCalled(name, wanted)) return true;
  }
  return false;
}

std::vector<bool> ChooseHeldOut(const std::string& spec, std::span<const std::string> names) {
  std::vector<bool> held_out(names.size(), false);
  if (spec.empty()) return held_out;
  if (spec.starts_with(kEvery)) {
    const size_t n = static_cast<size_t>(ParseEvery(spec));
    for (size_t i = 0; i < names.size(); i += n) held_out[i] = true;
  } else {
    MarkNamed(spec, names, held_out);
  }
  const auto left = std::count(held_out.begin(), held_out.end(), false);
  if (left < 2) {
    throw UsageError(
        fmt::format("`holdout` {}: expected at least 2 photos to build from, found {} of {}", spec,
                    left, names.size()));
  }
  return held_out;
}

std::vector<bool> ChooseHeldOutPanoramas(const std::string& spec,
                                         std::span<const std::string> names,
                                         std::span<const std::string> panorama_of) {
  if (spec.empty()) return std::vector<bool>(names.size(), false);
  std::vector<std::string> panoramas(panorama_of.begin(), panorama_of.end());
  std::sort(panoramas.begin(), panoramas.end());
  panoramas.erase(std::unique(panoramas.begin(), panoramas.end()), panoramas.end());
  std::string of_panoramas = spec;
  if (!spec.starts_with(kEvery)) {  // a view's name stands for its panorama's
    of_panoramas.clear();
    std::istringstream list(spec);
    for (std::string wanted; std::getline(list, wanted, ',');) {
      const auto view = std::find_if(names.begin(), names.end(), [&](const std::string& name) {
        return IsCalled(name, wanted);
      });
      if (!of_panoramas.empty()) of_panoramas += ',';
      of_panoramas +=
          view == names.end() ? wanted : panorama_of[static_cast<size_t>(view - names.begin())];
    }
  }
  const std::vector<bool> chosen = ChooseHeldOut(of_panoramas, panoramas);
  std::vector<bool> held_out;
  for (const std::string& panorama : panorama_of) {
    const auto at = std::lower_bound(panoramas.begin(), panoramas.end(), panorama);
    held_out.push_back(chosen[static_cast<size_t>(at - panoramas.begin())]);
  }
  return held_out;
}

}  // namespace dtr::pipeline
