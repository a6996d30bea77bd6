// SPEC 7.1: the image with its holes filled; alpha stays: 1 where seen.
#include "between.glsl"
#include "colour.glsl"
uniform sampler2D image;

layout(location = 0) out vec4 out_image;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 seen = texelFetch(image, at, 0);
  out_image = seen.a > 0.5 ? seen : vec4(SrgbFromLinear(Between(at).rgb), 0.0);
}
