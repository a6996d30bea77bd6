// SPEC 5.1: a single sample of a view's surface, as large as its cell (SPEC 3.1).
layout(local_size_x = 64) in;
#include "coarse_depth.glsl"

uniform float sample_step;  // R, depth pixels

const float kLargestHalfPx = 32.0;

vec2 ScreenDerivative(vec3 q, vec3 dq) {
  return novel_camera.xy * (dq.xy - q.xy / q.z * dq.z) / q.z;
}

void main() {
  int index = Primitive();
  if (index >= primitive_count) return;
  int first = 5 * index;
  float w = primitives[first + 2];
  vec3 q = Homogeneous(vec2(primitives[first], primitives[first + 1]), w);
  if (!InFront(q, w)) return;
  vec2 du = ScreenDerivative(q, novel_from_view[0] * (sample_step / depth_camera.x) +
                                    view_centre * primitives[first + 3]);
  vec2 dv = ScreenDerivative(q, novel_from_view[1] * (sample_step / depth_camera.y) +
                                    view_centre * primitives[first + 4]);
  if (!(du.x * dv.y - du.y * dv.x > 0.0)) return;  // SPEC 2.4: the back of a surface
  vec2 extent = abs(du) + abs(dv);
  float half_px = min(0.5 * max(extent.x, extent.y), kLargestHalfPx);
  vec2 centre = Screen(q);
  ivec2 xs = PixelRange(centre.x - half_px, centre.x + half_px, 0, width_px);
  ivec2 ys = PixelRange(centre.y - half_px, centre.y + half_px, first_row, first_row + rows);
  for (int y = ys.x; y <= ys.y; ++y) {
    for (int x = xs.x; x <= xs.y; ++x) Keep(x, y, w / q.z);
  }
}
