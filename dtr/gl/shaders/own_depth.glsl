// SPEC 5.2: a view's own fragment at a pixel, found on its full-resolution depth map from the
// coarse depth. Expects `depths`, an array of sampler2DArray with 1/z per sample (0: none), and
// PointInView, Centre.
const int kRefinements = 3;

// Inverse depth of the view's surface at a position on the sample grid (centre of the first at
// 0.5): bilinear where the four samples around belong together, else the nearest; 0: none.
float OwnInverseDepth(ViewBlock view, vec2 position) {
  ivec2 last = view.depth_slot.zw - 1;
  vec2 p = position - 0.5;
  if (any(lessThan(position, vec2(0.0))) || any(greaterThan(p, vec2(last) + 0.5))) return 0.0;
  ivec2 low = clamp(ivec2(floor(p)), ivec2(0), last);
  ivec2 high = min(low + 1, last);
  vec2 share = clamp(p - vec2(low), 0.0, 1.0);
#if DEPTH_ARRAYS == 1
  const int slot = 0;
#else
  int slot = view.depth_slot.x;
#endif
  int layer = view.depth_slot.y;
  vec4 w = vec4(texelFetch(depths[slot], ivec3(low, layer), 0).r,
                texelFetch(depths[slot], ivec3(high.x, low.y, layer), 0).r,
                texelFetch(depths[slot], ivec3(low.x, high.y, layer), 0).r,
                texelFetch(depths[slot], ivec3(high, layer), 0).r);
  float lowest = min(min(w.x, w.y), min(w.z, w.w)), highest = max(max(w.x, w.y), max(w.z, w.w));
  if (lowest > 0.0 && highest - lowest <= view.limits.w) {
    return mix(mix(w.x, w.y, share.x), mix(w.z, w.w, share.x), share.y);
  }
  return share.y < 0.5 ? (share.x < 0.5 ? w.x : w.y) : (share.x < 0.5 ? w.z : w.w);
}

// The inverse depth in the novel camera at which the ray meets the view's surface near `coarse`;
// 0 where the view shows another surface there, or none.
float OwnFragment(ViewBlock view, vec3 ray, float coarse) {
  float w = coarse;
  float along_ray = PointInView(view, ray, 0.0).z;  // z in the view is (along_ray - away w) / w
  float away = dot(vec3(view.row_x.z, view.row_y.z, view.row_z.z), Centre(view));
  for (int i = 0; i < kRefinements; ++i) {
    vec3 p = PointInView(view, ray, w);
    if (!(p.z > 0.0)) return 0.0;
    vec2 position = view.depth_grid.xy * (p.xy / p.z) + view.depth_grid.zw;
    float own = OwnInverseDepth(view, position);
    if (!(own > 0.0)) return 0.0;
    float next = own * along_ray / (1.0 + own * away);
    // The tolerance of the coarse surface and of a sample drawn flat: beyond it is another surface.
    if (!(abs(next - coarse) <= view.gain.w)) return 0.0;
    w = next;
  }
  return w > 0.0 ? w : 0.0;
}
