// A finished picture into the framebuffer of a host that draws other things too: colour, and depth as
// the host's own projection would have it. Every pixel of the viewport pays for each line here.
#if PACKED
uniform usampler2DArray texels;  // DrawnPicture::texels
#else
uniform sampler2DArray image;  // sRGB; alpha 0: nothing, 1: seen, between: guessed
uniform sampler2DArray depth;  // plane z, scene units; 0 where there is nothing
#endif
uniform vec4 texel_from_pixel;  // pixel of the framebuffer times xy plus zw
uniform vec4 mapping;  // device z = x + y / z; least device z = z; window z from 0 to 1 = (device z - z) * w
uniform int clamps;    // 1: the host has GL_DEPTH_CLAMP on

layout(location = 0) out vec4 out_colour;

void main() {
  // A pixel's centre lies half a pixel inside the viewport, its texel inside the picture.
  ivec3 texel = ivec3(gl_FragCoord.xy * texel_from_pixel.xy + texel_from_pixel.zw, 0);
#if PACKED
  uvec2 both = texelFetch(texels, texel, 0).rg;
  float z = uintBitsToFloat(both.x);
  vec4 colour = unpackUnorm4x8(both.y);
#else
  float z = texelFetch(depth, texel, 0).r;
  vec4 colour = texelFetch(image, texel, 0);
#endif
  float device_z = mapping.x + mapping.y / z;
  float inside = clamp(device_z, mapping.z, 1.0);
  // Where there is nothing the host's background stays, and what is nearer than the near plane or
  // farther than the far plane is clipped, as fixed function does. Guesses stay.
  bool seen = colour.a == 1.0;
  if (colour.a == 0.0 || !(z > 0.0) || (seen && clamps == 0 && inside != device_z)) discard;
  // The last step of 24 bits before the far plane: what is cleared to that must not hide a guess.
  float window_z = min((inside - mapping.z) * mapping.w, seen ? 1.0 : 0.9999999);
  gl_FragDepth = gl_DepthRange.near + gl_DepthRange.diff * window_z;
  out_colour = vec4(colour.rgb, 1.0);
}
