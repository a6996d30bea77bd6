// dtr/cpu/raster.h -- exact triangle and square coverage in double precision.
#pragma once
#include "dtr/cpu/layer.h"

namespace dtr::cpu {

/// A point of the novel image: position in pixels and inverse depth, which is linear on screen.
struct ScreenVertex {
  double x = 0, y = 0, inverse_depth = 0;
};

/// Rounds a screen coordinate to 1/2048 pixel: then products of differences are exact in double on
/// images up to 16384 pixels a side, and neighbouring triangles leave no crack (SPEC 2.4).
double SnapToSubpixel(double coordinate_px);

/// SPEC 2.4. Draws a triangle whose vertices run clockwise on the screen (y down), the nearest
/// fragment wins; others show the back of a surface and are dropped. A pixel belongs to a triangle
/// when its centre is inside, or on a top or left edge: meshes cover every pixel once. Vertices
/// must be snapped.
void DrawTriangle(const ScreenVertex& a, const ScreenVertex& b, const ScreenVertex& c,
                  Layer& layer);

/// SPEC 3. Fills the pixels whose centre lies in [x - half, x + half) x [y - half, y + half).
void DrawSquare(const ScreenVertex& center, double half_px, Layer& layer);

}  // namespace dtr::cpu
