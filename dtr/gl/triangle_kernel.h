// dtr/gl/triangle_kernel.h -- SPEC 5.1: small triangles, a row at once with the processor's vector
// instructions. Only dtr/gl's own .cpp files include this.
#pragma once

namespace dtr::gl {

/// A triangle that runs clockwise on the screen (y down), and the pixels asked for.
struct SmallTriangle {
  /// A side from (x, y): pixels whose centres are at along_x dy - along_y dx >= reach from there
  /// are inside of it.
  struct Side {
    float x, y, along_x, along_y, reach;
  };
  Side sides[3];
  float x, y, w, along_x, along_y;  ///< inverse depth: w at (x, y), and its slopes per pixel
  float farther, nearer;            ///< it stays between these
  int left, right, top, bottom;     ///< pixels, the last ones included
};

/// Columns that one vector holds: triangles may be as wide.
int SmallTriangleWidth();

/// Keeps the nearer of the triangle and what is there. `row`: pixel (0, top); pictures are
/// `width_px` wide, at least SmallTriangleWidth().
void DrawSmallTriangle(const SmallTriangle& triangle, float* row, int width_px);

}  // namespace dtr::gl
