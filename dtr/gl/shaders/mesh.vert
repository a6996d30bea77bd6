// SPEC 2.4, 2.5: a sample or a corner of a closed cell, seen from the novel camera. Depth is
// near_z / z: linear on the screen, at most 1 (the near plane), and the nearest is the largest.
// Define CLIP_CONTROL: clip space's z runs from 0 to 1, so that the rasteriser's own depth keeps
// float's precision; without it (OpenGL 4.3) mesh.frag writes the depth.
layout(location = 0) in vec3 surface_point;  // depth-grid position (pixels), 1/z in the view

uniform vec4 depth_camera;   // fx, fy, cx, cy of the depth grid, pixels
uniform mat3 novel_from_view;
uniform vec3 view_centre;    // in the novel frame, scene units
uniform vec4 clip_from_cam;  // x = xy.x * X + zw.x * Z, y likewise, before the division
uniform float near_z;        // scene units

#if !CLIP_CONTROL
out float view_near_share;  // near_z times 1/z in the view
#endif

void main() {
  vec3 ray = vec3((surface_point.xy - depth_camera.zw) / depth_camera.xy, 1.0);
  // The point times its inverse depth: no division, and no depth is too large.
  vec3 q = novel_from_view * ray + view_centre * surface_point.z;
  float near_share = near_z * surface_point.z;
#if CLIP_CONTROL
  float z = near_share;  // cut at q.z, which is SPEC 2.5's z >= near
#else
  view_near_share = near_share;
  float z = q.z - 2.0 * near_share;  // cut at -q.z, the same plane
#endif
  gl_Position = vec4(clip_from_cam.xy * q.xy + clip_from_cam.zw * q.z, z, q.z);
}
