// The pixels of a fragment of quick_resolve.frag: kAcross columns of kDown rows, and the surfaces
// there.
layout(std430, binding = 2) readonly buffer Depth { uint nearest[]; };  // SPEC 5.1
uniform int width_px, rows_px;                                          // of the band

const int kAcross = 4, kDown = 2, N = kAcross * kDown;

// In the band, of the fragment's k-th pixel, rows one after another.
ivec2 PixelAt(ivec2 at, int k) {
  return ivec2(at.x * kAcross + k % kAcross, at.y * kDown + k / kAcross);
}

float SurfaceAt(ivec2 at, int k) {
  ivec2 pixel = PixelAt(at, k);
  return uintBitsToFloat(nearest[min(pixel.y, rows_px - 1) * width_px + min(pixel.x, width_px - 1)]);
}
