// The finished image with its depth into a framebuffer of another program; row 0 of the image is on top.
uniform sampler2D image;
uniform highp usampler2D depth;    // bits of 1/z; 0: nothing was seen
uniform vec4 viewport;             // x, y, width, height, pixels
uniform vec2 image_from_viewport;  // pixels
uniform vec2 depth_of;             // a, b: depth in normalised device coordinates is a + b / z
uniform int linear;                // 1: linear light, 0: sRGB

#include "bilinear.glsl"
#include "colour.glsl"
layout(location = 0) out vec4 out_colour;

void main() {
  vec2 at = gl_FragCoord.xy - viewport.xy;
  vec2 pixel = vec2(at.x, viewport.w - at.y) * image_from_viewport;
  float w = uintBitsToFloat(texelFetch(depth, ivec2(pixel), 0).r);
  gl_FragDepth = w > 0.0 ? clamp(0.5 + 0.5 * (depth_of.x + depth_of.y * w), 0.0, 1.0) : 1.0;
  vec3 colour = ImageAt(image, pixel);
  out_colour = vec4(linear == 1 ? LinearFromSrgb(colour) : colour, 1.0);
}
