// One view as quick_resolve.frag knows it for SPEC 4 and 5; the same text is read by C++
// (dtr/gl/quick_resolve.cpp) and GLSL. Everything is relative to the novel camera and was formed in
// double precision.
#ifdef __cplusplus
struct QuickBlock {
#define vec4 std::array<float, 4>
#else
struct QuickBlock {
#endif
  // Novel ray r (z = 1) at inverse depth w to the view's grid of samples (centre of the first at
  // 0.5), homogeneous: x = grid_x.xyz . r + grid_x.w w, y and z likewise.
  vec4 grid_x, grid_y, grid_z;
  vec4 centre;  // the view's, in the novel frame, scene units; its squared length
  vec4 map;     // OwnMap.grid
  vec4 stored;  // OwnMap.stored
  vec4 colour;  // texture coordinates of the image: grid position * xy + zw
  vec4 limits;  // Delta (of 1/z); layers of the image and of the depth in their arrays; unused
};
#ifdef __cplusplus
#undef vec4
#endif
