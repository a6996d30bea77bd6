// A finished picture into the framebuffer of a host that draws other things too: colour, and depth as
// the host's own projection would have it.
uniform sampler2DArray image;  // sRGB; alpha 0 where no view saw anything
uniform sampler2DArray depth;  // plane z, scene units; 0 where unseen
uniform vec4 viewport;         // x, y, width, height in pixels of the framebuffer
uniform vec4 mapping;  // device z = x + y / z; least device z = z; window z from 0 to 1 = (device z - z) * w
uniform int clamps;    // 1: the host has GL_DEPTH_CLAMP on
uniform int top_first; // 1: row 0 of the framebuffer is its top row

layout(location = 0) out vec4 out_colour;

void main() {
  ivec2 size = textureSize(image, 0).xy;
  ivec2 texel = ivec2((gl_FragCoord.xy - viewport.xy) / viewport.zw * vec2(size));
  texel = clamp(texel, ivec2(0), size - 1);
  if (top_first == 0) texel.y = size.y - 1 - texel.y;
  vec4 colour = texelFetch(image, ivec3(texel, 0), 0);
  float z = texelFetch(depth, ivec3(texel, 0), 0).r;
  if (colour.a == 0.0 || !(z > 0.0)) discard;  // the host's background stays
  float device_z = mapping.x + mapping.y / z;
  // What fixed function clips: nearer than the near plane, farther than the far plane.
  if (clamps == 0 && (device_z < mapping.z || device_z > 1.0)) discard;
  float window_z = clamp((device_z - mapping.z) * mapping.w, 0.0, 1.0);
  gl_FragDepth = gl_DepthRange.near + gl_DepthRange.diff * window_z;
  out_colour = vec4(colour.rgb, 1.0);
}
