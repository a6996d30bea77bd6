// SPEC 5.1: samples of a view that no triangle holds, as large as their cells (SPEC 3.1).
layout(local_size_x = 64) in;
#include "coarse_depth.glsl"
struct Cell {
  uint half_samples;
  float inverse_depth, slope_x, slope_y;  // per sample
};
layout(std430, binding = 1) readonly buffer Cells { Cell cells[]; };

const float kLargestHalfPx = 32.0;

vec2 ScreenDerivative(vec3 q, vec3 dq) { return (dq.xy - q.xy / q.z * dq.z) / q.z; }

void main() {
  uvec2 batch = Batch();
  uint index = batch.x + gl_LocalInvocationIndex;
  if (gl_LocalInvocationIndex >= batch.y) return;  // never shared: squares are bounded
  Cell cell = cells[index];
  float w = cell.inverse_depth;
  vec3 q = Homogeneous(cell.half_samples, w);
  if (!InFront(q, w)) return;
  vec2 du = ScreenDerivative(q, 2.0 * screen_from_grid[0] + screen_from_centre * cell.slope_x);
  vec2 dv = ScreenDerivative(q, 2.0 * screen_from_grid[1] + screen_from_centre * cell.slope_y);
  if (!(du.x * dv.y - du.y * dv.x > 0.0)) return;  // SPEC 2.4: the back of a surface
  vec2 extent = abs(du) + abs(dv);
  float half_px = min(0.5 * max(extent.x, extent.y), kLargestHalfPx);
  vec2 centre = q.xy / q.z;
  ivec2 xs = PixelRange(centre.x - half_px, centre.x + half_px, 0, width_px);
  ivec2 ys = PixelRange(centre.y - half_px, centre.y + half_px, first_row, first_row + rows);
  for (int y = ys.x; y <= ys.y; ++y) {
    for (int x = xs.x; x <= xs.y; ++x) Keep(x, y, w / q.z);
  }
}
