// tests/io/small_mesh.h -- a mesh record of which every field says something.
#pragma once
#include <string>

#include "dtr/types/block_cover.h"

namespace dtr::io::testing_support {

inline StoredMesh SmallMesh() {
  StoredMesh mesh;
  mesh.depth_sha256 = std::string(62, '0') + "9f";
  mesh.resolution = 2;
  mesh.tolerance = 0.5;
  mesh.depth_break = 1.25;
  mesh.cover.columns = 34;
  mesh.cover.rows = 18;
  mesh.cover.rectangles = {{0, 0, 16, 16}, {16, 3, 5, 1}, {32, 0, 1, 16}, {30, 16, 2, 1}};
  return mesh;
}

}  // namespace dtr::io::testing_support
