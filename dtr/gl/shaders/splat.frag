// SPEC 3.1: pixels whose centres lie in the half-open square; the nearest fragment stays (MAX).
flat in vec4 square;  // centre (pixels), half side (pixels), inverse depth

uniform float first_row;  // of the band, pixels

layout(location = 0) out float inverse_depth;

void main() {
  vec2 pixel = gl_FragCoord.xy + vec2(0.0, first_row);
  bool inside = all(greaterThanEqual(pixel, square.xy - square.z)) &&
                all(lessThan(pixel, square.xy + square.z));
  inverse_depth = inside ? square.w : 0.0;
}
