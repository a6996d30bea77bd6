// SPEC 5.1: the triangles of a view's reduced mesh.
layout(local_size_x = 64) in;
#include "coarse_depth.glsl"
layout(std430, binding = 1) readonly buffer Corners { uvec2 corners[]; };  // half samples, 1/z

// Pixels this near to an edge belong to the triangle: rounding leaves no cracks.
const float kMarginPx = 1.0 / 256.0;

// Screen positions and inverse depths; this invocation draws every `sharing`-th row.
void Triangle(vec3 a, vec3 b, vec3 c, int share, int sharing) {
  vec2 ab = b.xy - a.xy, ac = c.xy - a.xy, bc = c.xy - b.xy;
  float area = ab.x * ac.y - ab.y * ac.x;
  if (!(area > 1e-6)) return;  // a back, or thinner than rounding
  vec2 low = min(a.xy, min(b.xy, c.xy)) - kMarginPx, high = max(a.xy, max(b.xy, c.xy)) + kMarginPx;
  ivec2 xs = PixelRange(low.x, high.x, 0, width_px);
  ivec2 ys = PixelRange(low.y, high.y, first_row, first_row + rows);
  float nearer = max(a.z, max(b.z, c.z)), farther = min(a.z, min(b.z, c.z));
  vec2 w_along = vec2((b.z - a.z) * ac.y - (c.z - a.z) * ab.y,
                      (c.z - a.z) * ab.x - (b.z - a.z) * ac.x) / area;
  // Where the edges a-b, b-c, c-a cross a row; those that go down bound it on the right.
  vec3 down = vec3(ab.y, bc.y, -ac.y);
  vec3 across = vec3(ab.x, bc.x, -ac.x) / down;
  vec3 reach = kMarginPx * vec3(length(ab), length(bc), length(ac)) / abs(down);
  vec3 x0 = vec3(a.x, b.x, c.x), y0 = vec3(a.y, b.y, c.y);
  for (int y = ys.x + share; y <= ys.y; y += sharing) {
    vec3 at = x0 + across * (float(y) + 0.5 - y0);
    vec3 ends = mix(vec3(1e9), at + reach, greaterThan(down, vec3(0.0)));
    vec3 starts = mix(vec3(-1e9), at - reach, lessThan(down, vec3(0.0)));
    float start = max(starts.x, max(starts.y, starts.z)), end = min(ends.x, min(ends.y, ends.z));
    int first = max(xs.x, int(ceil(max(start, -1.0) - 0.5)));
    int last = min(xs.y, int(floor(min(end, 1e6) - 0.5)));
    float w = a.z + w_along.x * (float(first) + 0.5 - a.x) + w_along.y * (float(y) + 0.5 - a.y);
    for (int x = first; x <= last; ++x) {
      Keep(x, y, clamp(w, farther, nearer));
      w += w_along.x;
    }
  }
}

// SPEC 2.5: where the side between two points crosses the near plane; the same from both ends.
vec4 Crossing(vec4 p, vec4 q) {
  float beyond_p = p.z - near_z * p.w, beyond_q = q.z - near_z * q.w;
  vec4 front = beyond_p >= 0.0 ? p : q, back = beyond_p >= 0.0 ? q : p;
  float beyond = max(beyond_p, beyond_q);
  return mix(front, back, beyond / (beyond - min(beyond_p, beyond_q)));
}

vec3 OnScreen(vec4 p) { return vec3(p.xy / p.z, p.w / p.z); }

void Clipped(vec4 p[3], int share, int sharing) {
  vec3 polygon[4];
  int n = 0;
  for (int k = 0; k < 3; ++k) {
    vec4 here = p[k], next = p[(k + 1) % 3];
    bool here_in = here.z >= near_z * here.w, next_in = next.z >= near_z * next.w;
    if (here_in) polygon[n++] = OnScreen(here);
    if (here_in != next_in) polygon[n++] = OnScreen(Crossing(here, next));
  }
  for (int k = 1; k + 1 < n; ++k) {
    Triangle(polygon[0], polygon[k], polygon[k + 1], share, sharing);
  }
}

void main() {
  uvec2 batch = Batch();
  uint sharing = 1u << (batch.y >> 8);
  uint number = gl_LocalInvocationIndex / sharing;
  if (number >= (batch.y & 0xffu)) return;
  int share = int(gl_LocalInvocationIndex % sharing);
  vec4 p[3];  // homogeneous, then 1/z in the view
  bool all_in_front = true;
  for (int k = 0; k < 3; ++k) {
    uvec2 vertex = corners[3u * (batch.x + number) + uint(k)];
    float w = uintBitsToFloat(vertex.y);
    p[k] = vec4(Homogeneous(vertex.x, w), w);
    all_in_front = all_in_front && InFront(p[k].xyz, w);
  }
  if (all_in_front) {
    Triangle(OnScreen(p[0]), OnScreen(p[1]), OnScreen(p[2]), share, int(sharing));
  } else {
    Clipped(p, share, int(sharing));
  }
}
