// SPEC 3: a sample as a square on the screen; four vertices each, the fragment shader cuts exactly.
layout(std430, binding = 1) readonly buffer Splats {
  float splats[];  // per sample: depth-grid position (2), 1/z, slopes of 1/z along x and y
};

uniform vec4 depth_camera;    // fx, fy, cx, cy of the depth grid, pixels
uniform mat3 novel_from_view;
uniform vec3 view_centre;     // in the novel frame, scene units
uniform vec4 novel_camera;    // fx, fy, cx, cy, pixels
uniform vec2 novel_size;      // pixels
uniform float near_z;         // scene units
uniform float sample_step;    // R, depth pixels
uniform float point_size;

flat out vec4 square;  // centre (pixels), half side (pixels), near_z / z

const float kSubpixels = 2048.0;   // SPEC 2.4
const float kLargestHalfPx = 32.0; // SPEC 3.2
const float kMarginPx = 0.0625;    // more than the rasteriser's own rounding

// Derivative of the projection at q (times 1/w) along dq.
vec2 ScreenDerivative(vec3 q, vec3 dq) {
  return novel_camera.xy * (dq.xy - q.xy / q.z * dq.z) / q.z;
}

void main() {
  int first = 5 * (gl_VertexID >> 2);
  vec2 position = vec2(splats[first], splats[first + 1]);
  float w = splats[first + 2];
  vec3 ray = vec3((position - depth_camera.zw) / depth_camera.xy, 1.0);
  vec3 q = novel_from_view * ray + view_centre * w;
  gl_Position = vec4(-2.0, -2.0, -2.0, 1.0);  // not drawn
  square = vec4(0.0);
  if (!(q.z > 0.0 && q.z >= near_z * w)) return;

  vec3 along_u = novel_from_view[0] * (sample_step / depth_camera.x) + view_centre * splats[first + 3];
  vec3 along_v = novel_from_view[1] * (sample_step / depth_camera.y) + view_centre * splats[first + 4];
  vec2 du = ScreenDerivative(q, along_u), dv = ScreenDerivative(q, along_v);
  if (!(du.x * dv.y - du.y * dv.x > 0.0)) return;  // SPEC 2.4: the back of a surface
  vec2 extent = abs(du) + abs(dv);
  float half_px = min(0.5 * point_size * max(extent.x, extent.y), kLargestHalfPx);
  vec2 centre = novel_camera.xy * (q.xy / q.z) + novel_camera.zw;
  centre = floor(centre * kSubpixels + 0.5) / kSubpixels;
  square = vec4(centre, half_px, near_z * w / q.z);

  int corner = gl_VertexID & 3;
  vec2 side = vec2((corner & 1) == 0 ? -1.0 : 1.0, (corner & 2) == 0 ? -1.0 : 1.0);
  vec2 at = centre + side * (half_px + kMarginPx);
  gl_Position = vec4(2.0 * at / novel_size - 1.0, 0.0, 1.0);
}
