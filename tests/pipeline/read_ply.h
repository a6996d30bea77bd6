// tests/pipeline/read_ply.h -- vertices of a binary PLY file (triangles may follow), read from its
// header alone.
#pragma once
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "dtr/base/files.h"

namespace dtr::testing {

struct Ply {
  std::vector<std::string> comments, names;
  std::map<std::string, std::vector<double>> values;
  size_t count = 0;
  const std::vector<double>& operator[](const std::string& name) const { return values.at(name); }
  bool HasComment(const std::string& text) const {
    for (const std::string& comment : comments) {
      if (comment.find(text) != std::string::npos) return true;
    }
    return false;
  }
};

inline Ply ReadPly(const std::filesystem::path& file) {
  const std::string bytes = ReadFile(file, 1 << 28);
  const std::string end = "end_header\n";
  const size_t body = bytes.find(end) + end.size();
  std::istringstream header(bytes.substr(0, body));
  Ply ply;
  std::vector<std::string> types;
  size_t triangles = 0;
  for (std::string line; std::getline(header, line);) {
    std::istringstream words(line);
    std::string first, second, third;
    words >> first >> second >> third;
    if (first == "comment") ply.comments.push_back(line.substr(8));
    if (first == "element") (second == "vertex" ? ply.count : triangles) = std::stoul(third);
    if (first != "property" || second == "list") continue;
    types.push_back(second);
    ply.names.push_back(third);
  }
  size_t at = body;
  const auto next = [&](auto value) {
    if (at + sizeof value > bytes.size()) throw std::runtime_error("PLY: cut short");
    std::memcpy(&value, bytes.data() + at, sizeof value);
    at += sizeof value;
    return static_cast<double>(value);
  };
  for (size_t i = 0; i < ply.count; ++i) {
    for (size_t p = 0; p < types.size(); ++p) {
      ply.values[ply.names[p]].push_back(types[p] == "double"  ? next(double{})
                                         : types[p] == "float" ? next(float{})
                                                               : next(std::uint8_t{}));
    }
  }
  constexpr size_t kTriangleBytes = 13;
  if (at + kTriangleBytes * triangles != bytes.size())
    throw std::runtime_error("PLY: not as long as its header says");
  return ply;
}

}  // namespace dtr::testing
