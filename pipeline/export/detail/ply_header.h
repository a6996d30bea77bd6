// pipeline/export/detail/ply_header.h -- headers of PLY files whose number of vertices is known
// last.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace dtr::pipeline {

/// Header of a binary little-endian PLY file of vertices; the same number of bytes for any count:
/// a comment at the end makes up for its digits. `properties`: "float x". Comments must have no
/// line ends.
std::string PlyHeader(size_t count, const std::vector<std::string>& comments,
                      const std::vector<std::string>& properties);

}  // namespace dtr::pipeline
