// SPEC 4.4: the colour a view shows at a point. Images hold sRGB values (SampledImage); alpha is
// SPEC 4.8's factor at the rim, 0 only where a pixel is masked. Weighted by hand, since a texture unit blends with 8 bits. Expects
// `images`, an array of sampler2DArray, and LINEAR_LIGHT.
#include "view_block.glsl"

const float kLeastFactor = 1.0 / 255.0;  // SPEC 1.4, 4.8

vec3 SrgbFromLinear(vec3 linear) {
  vec3 c = max(linear, 0.0);
  return mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c,
             lessThanEqual(c, vec3(0.0031308)));
}

vec3 LinearFromSrgb(vec3 srgb) {
  return mix(pow((srgb + 0.055) / 1.055, vec3(2.4)), srgb / 12.92,
             lessThanEqual(srgb, vec3(0.04045)));
}

// RGB in the values that are blended, and the factor; all 0 where every pixel around is masked. `pixel`:
// centre of the first at 0.5.
vec4 ColourAt(ViewBlock view, vec2 pixel) {
  vec2 position = clamp(pixel - 0.5, vec2(0.0), view.limits.xy - 1.0);
  ivec2 low = ivec2(position);
  ivec2 high = min(low + 1, ivec2(view.limits.xy) - 1);
  vec2 share = position - vec2(low);
  vec4 weight = vec4((1.0 - share.x) * (1.0 - share.y), share.x * (1.0 - share.y),
                     (1.0 - share.x) * share.y, share.x * share.y);
#if IMAGE_ARRAYS == 1
  const int slot = 0;  // known to the compiler: no choice between samplers at every fetch
#else
  int slot = view.image.x;
#endif
  int layer = view.image.y;
  vec4 texel[4] = vec4[](texelFetch(images[slot], ivec3(low, layer), 0),
                         texelFetch(images[slot], ivec3(high.x, low.y, layer), 0),
                         texelFetch(images[slot], ivec3(low.x, high.y, layer), 0),
                         texelFetch(images[slot], ivec3(high, layer), 0));
  vec3 sum = vec3(0.0);
  float usable = 0.0;
  for (int i = 0; i < 4; ++i) {
#if LINEAR_LIGHT
    texel[i].rgb = LinearFromSrgb(texel[i].rgb);
#endif
    sum += weight[i] * texel[i].rgb;
    usable += weight[i] * texel[i].a;
  }
  return usable > 0.0 ? vec4(sum, max(usable, kLeastFactor)) : vec4(0.0);
}
