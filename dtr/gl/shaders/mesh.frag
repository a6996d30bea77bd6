// SPEC 2.4, 4.2: depth alone; the depth test keeps the nearest fragment. See mesh.vert.
#if !CLIP_CONTROL
in float view_near_share;
#endif

void main() {
#if !CLIP_CONTROL
  // w / q.z is linear on the screen; gl_FragCoord.w is the interpolated 1 / q.z.
  float depth = view_near_share * gl_FragCoord.w;
  if (!(depth < 1.0)) discard;  // rounding on a sliver
  gl_FragDepth = depth;
#endif
}
