// SPEC 5.1: a sample that no triangle holds, as a square as large as its cell (SPEC 3.1); four corners an instance.
layout(location = 0) in vec3 cell;   // half samples, 1/z in the view
layout(location = 1) in vec2 slope;  // of 1/z per sample
#include "coarse.glsl"

const float kLargestHalfPx = 32.0;  // SPEC 3.2

vec2 ScreenDerivative(vec3 q, vec3 dq) { return (dq.xy - q.xy / q.z * dq.z) / q.z; }

void main() {
  gl_Position = vec4(-2.0, -2.0, -2.0, 1.0);  // not drawn
  float w = cell.z;
  vec3 q = Homogeneous(cell.xy, w);
  near_share = least_near_z * w / q.z;
  if (!(q.z > 0.0) || q.z < near_z * w) return;
  vec2 du = ScreenDerivative(q, 2.0 * screen_from_grid[0] + screen_from_centre * slope.x);
  vec2 dv = ScreenDerivative(q, 2.0 * screen_from_grid[1] + screen_from_centre * slope.y);
  if (!(du.x * dv.y - du.y * dv.x > 0.0)) return;  // SPEC 2.4: the back of a surface
  vec2 extent = abs(du) + abs(dv);
  float half_px = min(0.5 * max(extent.x, extent.y), kLargestHalfPx);
  vec2 side = vec2((gl_VertexID & 1) == 0 ? -1.0 : 1.0, (gl_VertexID & 2) == 0 ? -1.0 : 1.0);
  gl_Position = vec4(2.0 * (q.xy / q.z + side * half_px) / size_px - 1.0, 0.0, 1.0);
}
