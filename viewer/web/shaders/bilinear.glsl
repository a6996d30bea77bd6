// The image at a position, pixel centres at + 0.5; exact there.
vec3 ImageAt(sampler2D image, vec2 pixel) {
  vec2 centre = pixel - 0.5;
  ivec2 last = textureSize(image, 0) - 1, low = clamp(ivec2(floor(centre)), ivec2(0), last), high = min(low + 1, last);
  vec2 share = clamp(centre - vec2(low), 0.0, 1.0);
  return mix(mix(texelFetch(image, low, 0).rgb, texelFetch(image, ivec2(high.x, low.y), 0).rgb, share.x),
             mix(texelFetch(image, ivec2(low.x, high.y), 0).rgb, texelFetch(image, high, 0).rgb, share.x), share.y);
}
