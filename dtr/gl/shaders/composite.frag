// A finished picture into the framebuffer of a host that draws other things too: colour, and depth as
// the host's own projection would have it.
uniform sampler2DArray image;  // sRGB; alpha 0: nothing, 1: seen, between: guessed
uniform sampler2DArray depth;  // plane z, scene units; 0 where there is nothing
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
  // What fixed function clips: nearer than the near plane, farther than the far plane. Guesses stay.
  bool guessed = colour.a < 1.0;
  if (!guessed && clamps == 0 && (device_z < mapping.z || device_z > 1.0)) discard;
  // The last step of 24 bits before the far plane: what is cleared to that must not hide a guess.
  float window_z = clamp((device_z - mapping.z) * mapping.w, 0.0, guessed ? 0.9999999 : 1.0);
  gl_FragDepth = gl_DepthRange.near + gl_DepthRange.diff * window_z;
  out_colour = vec4(colour.rgb, 1.0);
}
