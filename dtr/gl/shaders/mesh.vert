// SPEC 2.4, 2.5: a sample or a corner of a closed cell, seen from the novel camera.
layout(location = 0) in vec3 surface_point;  // depth-grid position (pixels), 1/z in the view

uniform vec4 depth_camera;   // fx, fy, cx, cy of the depth grid, pixels
uniform mat3 novel_from_view;
uniform vec3 view_centre;    // in the novel frame, scene units
uniform vec4 clip_from_cam;  // x = xy.x * X + zw.x * Z, y likewise, before the division
uniform float near_z;        // scene units

out float view_inverse_depth;

void main() {
  vec3 ray = vec3((surface_point.xy - depth_camera.zw) / depth_camera.xy, 1.0);
  // The point times its inverse depth: no division, and no depth is too large.
  vec3 q = novel_from_view * ray + view_centre * surface_point.z;
  view_inverse_depth = surface_point.z;
  // z = q.z - 2 near w is cut at -q.z, which is SPEC 2.5's z >= near.
  gl_Position = vec4(clip_from_cam.xy * q.xy + clip_from_cam.zw * q.z,
                     q.z - 2.0 * near_z * surface_point.z, q.z);
}
