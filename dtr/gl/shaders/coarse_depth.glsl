// SPEC 5.1: what the two rasterisers of the coarse surface share. Depth is kept as the bits of a
// positive float, whose order is that of unsigned numbers: atomicMax is exact and needs no order.
layout(std430, binding = 2) buffer Depth { uint nearest[]; };
layout(std430, binding = 1) readonly buffer Primitives { float primitives[]; };

uniform vec4 depth_camera;  // fx, fy, cx, cy of the depth grid, pixels
uniform mat3 novel_from_view;
uniform vec3 view_centre;   // in the novel frame, scene units
uniform vec4 novel_camera;  // fx, fy, cx, cy, pixels
uniform int width_px;
uniform int first_row, rows;  // of the band
uniform float near_z;       // scene units
uniform int primitive_count;

const int kGroup = 64;
const int kRow = 65535 * kGroup;  // invocations in a row of groups, the least a driver allows

int Primitive() { return int(gl_GlobalInvocationID.y) * kRow + int(gl_GlobalInvocationID.x); }

// The point at a depth-grid position, times its inverse depth w, in the novel frame.
vec3 Homogeneous(vec2 position, float w) {
  return novel_from_view * vec3((position - depth_camera.zw) / depth_camera.xy, 1.0) +
         view_centre * w;
}

bool InFront(vec3 q, float w) { return q.z > 0.0 && q.z >= near_z * w; }

vec2 Screen(vec3 q) { return novel_camera.xy * (q.xy / q.z) + novel_camera.zw; }

// First and last pixel whose centres lie in [low, high], cut to [begin, end); empty: first > last.
ivec2 PixelRange(float low, float high, int begin, int end) {
  if (!(high >= float(begin)) || !(low <= float(end))) return ivec2(0, -1);
  return ivec2(max(begin, int(ceil(max(low, float(begin) - 1.0) - 0.5))),
               min(end - 1, int(floor(min(high, float(end) + 1.0) - 0.5))));
}

void Keep(int x, int y, float w) {
  atomicMax(nearest[(y - first_row) * width_px + x], floatBitsToUint(w));
}
