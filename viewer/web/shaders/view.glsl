// One view as the shaders see it; js/frame.js writes it, nine vec4 each.
struct View {
  vec4 row_x, row_y, row_z;  // novel_from_view: rows of the rotation, translation as their fourth
  vec4 camera;      // fx, fy, cx, cy of the image, pixels
  vec4 size;        // width, height of the image; columns, rows of the depth map
  vec4 depth_grid;  // fx, fy, cx, cy of the depth map, pixels
  vec4 codes;       // 1/z of measured code c: x + y c; of completed code c: z + w c
  vec4 slots;       // layer; 1 if the view has a mask; number of measured codes; a pixel of disparity (of 1/z)
  vec4 fading;      // SPEC 1.4's factor, SPEC 4.8's gain and offset, SPEC 4.4's clipped
};

vec3 Centre(View view) { return vec3(view.row_x.w, view.row_y.w, view.row_z.w); }

// The point ray / w in the view's frame, times w.
vec3 PointInView(View view, vec3 ray, float w) {
  vec3 p = ray - Centre(view) * w;
  return view.row_x.xyz * p.x + view.row_y.xyz * p.y + view.row_z.xyz * p.z;
}

vec2 SourcePixel(View view, vec3 p) { return view.camera.xy * (p.xy / p.z) + view.camera.zw; }
