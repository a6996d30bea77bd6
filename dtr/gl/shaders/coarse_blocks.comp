// SPEC 5.1: a flat block of a view's surface, as two triangles.
layout(local_size_x = 64) in;
#include "coarse_depth.glsl"

// Pixels this near to an edge belong to the triangle: blocks of different sizes leave no cracks.
const float kMarginPx = 0.05;

void Triangle(vec3 a, vec3 b, vec3 c) {  // screen position, inverse depth
  vec2 ab = b.xy - a.xy, ac = c.xy - a.xy;
  float area = ab.x * ac.y - ab.y * ac.x;
  if (!(area > 1e-6)) return;  // a back, or thinner than rounding
  vec2 bc = c.xy - b.xy;
  vec3 margin = kMarginPx * vec3(length(bc), length(ac), length(ab));
  ivec2 xs = PixelRange(min(a.x, min(b.x, c.x)) - kMarginPx, max(a.x, max(b.x, c.x)) + kMarginPx,
                        0, width_px);
  ivec2 ys = PixelRange(min(a.y, min(b.y, c.y)) - kMarginPx, max(a.y, max(b.y, c.y)) + kMarginPx,
                        first_row, first_row + rows);
  float lowest = min(a.z, min(b.z, c.z)), highest = max(a.z, max(b.z, c.z));
  for (int y = ys.x; y <= ys.y; ++y) {
    for (int x = xs.x; x <= xs.y; ++x) {
      vec2 pa = vec2(x, y) + 0.5 - a.xy;
      float wb = pa.x * ac.y - pa.y * ac.x;
      float wc = ab.x * pa.y - ab.y * pa.x;
      float wa = area - wb - wc;
      if (any(lessThan(vec3(wa, wb, wc), -margin))) continue;
      Keep(x, y, clamp((wa * a.z + wb * b.z + wc * c.z) / area, lowest, highest));
    }
  }
}

void main() {
  int index = Primitive();
  if (index >= primitive_count) return;
  int first = 7 * index;
  vec2 position = vec2(primitives[first], primitives[first + 1]);
  float side = primitives[first + 2];
  vec3 corner[4];
  for (int k = 0; k < 4; ++k) {
    float w = primitives[first + 3 + k];
    vec3 q = Homogeneous(position + side * vec2(k & 1, k >> 1), w);
    if (!InFront(q, w)) return;
    corner[k] = vec3(Screen(q), w / q.z);
  }
  Triangle(corner[0], corner[1], corner[3]);
  Triangle(corner[0], corner[3], corner[2]);
}
