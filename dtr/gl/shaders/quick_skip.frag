// Depth 1 for fragments of quick_resolve.frag with a surface in any pixel, 0 for the others, so that
// the depth test passes over those: of all branches the only one that software rasterisers skip.
#include "quick_pixels.glsl"

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  float surface = 0.0;
  for (int k = 0; k < N; ++k) surface = max(surface, SurfaceAt(at, k));
  gl_FragDepth = surface > 0.0 ? 1.0 : 0.0;
}
