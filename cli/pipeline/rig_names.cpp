#include "cli/pipeline/rig_names.h"

#include <filesystem>

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

}  // namespace dtr::pipeline
