// SPEC 5.1: what triangles and cells of the reduced meshes share. Row 0 of the target is the image's top row, so that
// faces that are clockwise on the image (y down) are counter-clockwise for the rasteriser. Depth is near / z of the
// nearest of all views' near planes: linear on the screen, the nearest is the largest, and float keeps its precision.
uniform mat3 screen_from_grid;    // position in half samples (x, y, 1) to pixels times z
uniform vec3 screen_from_centre;  // the same for the view's centre; to be multiplied by 1/z
uniform vec2 size_px;
uniform float near_z;         // of the view, scene units
uniform float least_near_z;   // of all views

out float near_share;  // least_near_z times 1/z in the view

vec3 Homogeneous(vec2 half_samples, float w) {
  return screen_from_grid * vec3(half_samples, 1.0) + screen_from_centre * w;
}
