#include "pipeline/export/detail/ply_header.h"

namespace dtr::pipeline {

std::string PlyHeader(size_t count, const std::vector<std::string>& comments,
                      const std::vector<std::string>& properties) {
  constexpr size_t kMostDigits = 20;
  const std::string digits = std::to_string(count);
  std::string header = "ply\nformat binary_little_endian 1.0\n";
  for (const std::string& comment : comments) header += "comment " + comment + "\n";
  header += "comment " + std::string(kMostDigits - digits.size() + 1, '-') + "\n";
  header += "element vertex " + digits + "\n";
  for (const std::string& property : properties) header += "property " + property + "\n";
  return header + "end_header\n";
}

}  // namespace dtr::pipeline
