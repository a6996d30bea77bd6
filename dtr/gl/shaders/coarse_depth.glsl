// SPEC 5.1: what the rasterisers of the reduced meshes share. Depth is kept as the bits of a
// positive float, whose order is that of unsigned numbers: atomicMax is exact and needs no order.
layout(std430, binding = 2) buffer Depth { uint nearest[]; };
// What a group of invocations draws: first primitive; number of them, and from bit 8 on the
// logarithm to base 2 of how many invocations share each.
layout(std430, binding = 3) readonly buffer Batches { uvec2 batches[]; };

// Position in half samples (x, y, 1) to the novel screen, homogeneous: x, y in pixels times z.
uniform mat3 screen_from_grid;
uniform vec3 screen_from_centre;  // the same for the view's centre; to be multiplied by 1/z
uniform int width_px;
uniform int first_row, rows;  // of the band
uniform float near_z;         // scene units
uniform int first_batch, batch_count;  // of the view

// What this invocation's group draws.
uvec2 Batch() {
  int group = int(gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x);
  return group < batch_count ? batches[first_batch + group] : uvec2(0u);
}

// The point at a position of the grid, times its inverse depth w, on the novel screen.
vec3 Homogeneous(uint half_samples, float w) {
  return screen_from_grid * vec3(half_samples & 0xffffu, half_samples >> 16, 1.0) +
         screen_from_centre * w;
}

bool InFront(vec3 q, float w) { return q.z > 0.0 && q.z >= near_z * w; }

// First and last pixel whose centres lie in [low, high], cut to [begin, end); empty: first > last.
ivec2 PixelRange(float low, float high, int begin, int end) {
  if (!(high >= float(begin)) || !(low <= float(end))) return ivec2(0, -1);
  return ivec2(max(begin, int(ceil(max(low, float(begin) - 1.0) - 0.5))),
               min(end - 1, int(floor(min(high, float(end) + 1.0) - 0.5))));
}

void Keep(int x, int y, float w) {
  atomicMax(nearest[(y - first_row) * width_px + x], floatBitsToUint(w));
}
