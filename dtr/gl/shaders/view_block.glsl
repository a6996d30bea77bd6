// One view as the shaders know it; the same text is read by C++ (dtr/gl/resolve.cpp) and GLSL.
// Lengths stay in scene units, so nothing here depends on the world's origin: positions are
// relative to the novel camera and were formed in double precision (SPEC 0.5).
#ifdef __cplusplus
struct ViewBlock {
#define vec4 std::array<float, 4>
#define ivec4 std::array<int, 4>
#else
struct ViewBlock {
#endif
  vec4 row_x;   // novel_from_view: first row of the rotation, translation x
  vec4 row_y;   // second row, translation y
  vec4 row_z;   // third row, translation z
  vec4 camera;  // fx, fy, cx, cy of the view's image, pixels
  vec4 limits;  // image width, height (pixels), Delta (of 1/z); bits of a stored value of 1
  ivec4 image;  // texture array, layer in it, 1 if the view has a mask, unused
  vec4 depth_grid;   // fx, fy, cx, cy of the grid of samples (SPEC 5.3)
  ivec4 depth_slot;  // texture array, layer in it, unused
  vec4 map;          // 1 / width, 1 / height of that layer; columns / 2, rows / 2 of the grid
  // 1/z of a stored value v is x + y v (two passes: of the layer's); z: a pixel of disparity as a
  // difference of 1/z (SPEC 0.3); w: unused
  vec4 stored_depth;
  vec4 fading;  // SPEC 1.4's factor, SPEC 4.8's gain and offset, SPEC 4.4's clipped
};
#ifdef __cplusplus
#undef vec4
#undef ivec4
#endif
