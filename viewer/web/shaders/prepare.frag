// SPEC 4.4, 4.8: a photo as it is sampled, once per view: in the mean exposure of the set, masked pixels as the mean of
// their neighbours; alpha: how far from the photo's border, 0 where a pixel is masked.
uniform sampler2D photo;      // sRGB values
uniform sampler2D gain;       // 256 x 1: what the view's exposure makes of each value
uniform usampler2D distance_px;  // to the nearest masked pixel, 1 beside one; 0 at one (with MASKED)
uniform ivec2 size_px;
uniform float rim_px;

layout(location = 0) out vec4 out_image;

vec3 Exposed(ivec2 at) {
  ivec3 value = ivec3(texelFetch(photo, at, 0).rgb * 255.0 + 0.5);
  return vec3(texelFetch(gain, ivec2(value.r, 0), 0).r, texelFetch(gain, ivec2(value.g, 0), 0).g,
              texelFetch(gain, ivec2(value.b, 0), 0).b);
}

bool Usable(ivec2 at) {
#if MASKED
  return texelFetch(distance_px, at, 0).r != 0u;
#else
  return true;
#endif
}

vec3 MeanOfNeighbours(ivec2 at) {
  vec3 sum = vec3(0.0);
  float count = 0.0;
  for (int y = max(at.y - 1, 0); y <= min(at.y + 1, size_px.y - 1); ++y) {
    for (int x = max(at.x - 1, 0); x <= min(at.x + 1, size_px.x - 1); ++x) {
      if (!Usable(ivec2(x, y))) continue;
      sum += Exposed(ivec2(x, y));
      count += 1.0;
    }
  }
  return count > 0.0 ? sum / count : vec3(0.0);
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  if (!Usable(at)) {
    out_image = vec4(MeanOfNeighbours(at), 0.0);
    return;
  }
  ivec2 inside = min(at, size_px - 1 - at) + 1;  // steps to what is off the image
  float steps = float(min(inside.x, inside.y));
#if MASKED
  steps = min(steps, float(texelFetch(distance_px, at, 0).r));
#endif
  float factor = clamp((steps - 1.0) / rim_px, 1.0 / 255.0, 1.0);
  out_image = vec4(Exposed(at), floor(factor * 255.0 + 0.5) / 255.0);
}
