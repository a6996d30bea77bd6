// SPEC 2.4, 2.5, 5.1: corners of the triangles of a view's reduced mesh.
layout(location = 0) in vec3 corner;  // half samples, 1/z in the view
#include "coarse.glsl"

void main() {
  vec3 q = Homogeneous(corner.xy, corner.z);
  near_share = least_near_z * corner.z;
  // Clipped at z = -q.z: the view's near plane.
  gl_Position = vec4(2.0 * q.xy / size_px - q.z, q.z - 2.0 * near_z * corner.z, q.z);
}
