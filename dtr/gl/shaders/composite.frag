// A finished picture into the framebuffer of a host that draws other things too: colour, and depth as
// the host's own projection would have it. Every pixel of the viewport pays for each line here.
#if MAPPED
uniform sampler2D image;  // sRGB
uniform sampler2D depth;  // for the depth buffer; below 0 where nothing is drawn (window_depth.h)
#else
uniform sampler2DArray image;  // sRGB; alpha 0 where there is nothing
uniform sampler2DArray depth;  // plane z, scene units; 0 where there is nothing
uniform vec4 mapping;  // device z = x + y / z; least device z = z; window z from 0 to 1 = (device z - z) * w
uniform int clamps;    // 1: the host has GL_DEPTH_CLAMP on
#endif
uniform vec4 image_from_pixel;  // position in the image, 0 to 1 = pixel of the framebuffer times xy plus zw

layout(location = 0) out vec4 out_colour;

// The pixel of the picture by its number: which one a sampler takes near the border of two differs
// by driver. A pixel's centre lies half a pixel inside the viewport, its texel inside the picture.
void main() {
  ivec2 texel = ivec2((gl_FragCoord.xy * image_from_pixel.xy + image_from_pixel.zw) *
                      vec2(textureSize(image, 0).xy));
#if MAPPED
  float z = texelFetch(depth, texel, 0).r;
  vec4 colour = texelFetch(image, texel, 0);
#else
  float z = texelFetch(depth, ivec3(texel, 0), 0).r;
  vec4 colour = texelFetch(image, ivec3(texel, 0), 0);
#endif
#if MAPPED
  if (z < 0.0) discard;
  gl_FragDepth = z;
#else
  float device_z = mapping.x + mapping.y / z;
  float inside = clamp(device_z, mapping.z, 1.0);
  // Where there is nothing the host's background stays, and what is nearer than the near plane or
  // farther than the far plane is clipped, as fixed function does.
  if (colour.a == 0.0 || !(z > 0.0) || (clamps == 0 && inside != device_z)) discard;
  gl_FragDepth = gl_DepthRange.near + gl_DepthRange.diff * ((inside - mapping.z) * mapping.w);
#endif
  out_colour = vec4(colour.rgb, 1.0);
}
