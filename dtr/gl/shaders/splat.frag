// SPEC 3.1: pixels whose centres lie in the half-open square; the depth test keeps the nearest.
flat in vec4 square;  // centre (pixels), half side (pixels), near_z / z

uniform float first_row;  // of the band, pixels

void main() {
  vec2 pixel = gl_FragCoord.xy + vec2(0.0, first_row);
  bool inside = all(greaterThanEqual(pixel, square.xy - square.z)) &&
                all(lessThan(pixel, square.xy + square.z));
  if (!inside) discard;
  gl_FragDepth = square.w;
}
