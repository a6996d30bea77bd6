// SPEC 8: edges of surfaces without stairs, on the filled image.
#include "colour.glsl"
uniform sampler2D image;    // filled
uniform highp usampler2D depth;  // bits of 1/z; 0: not seen
uniform ivec2 size_px;
uniform vec4 novel_camera;
uniform vec3 centres[MAX_VIEWS];  // of the views, in the novel frame
uniform int view_count;

layout(location = 0) out vec4 out_image;

const float kLeastBend = 0.02, kFullBend = 0.04;

bool Inside(ivec2 at) { return all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, size_px)); }
float InverseDepth(ivec2 at) { return uintBitsToFloat(texelFetch(depth, at, 0).r); }

// SPEC 8.3: by how many pixels, at most 1, the edge is displaced against far background from here to the nearest view.
float Displacement(vec3 ray, float w) {
  float squared = dot(ray, ray), scale = novel_camera.x * w, least = 1.0;
  for (int i = 0; i < view_count; ++i) {
    vec3 centre = centres[i];
    float along = squared - w * dot(ray, centre);
    vec3 c = cross(ray, centre);
    float across = scale * scale * dot(c, c);
    if (along > 0.0 && across < least * along * along) least = across / (along * along);
  }
  return sqrt(least);
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 here = texelFetch(image, at, 0);
  out_image = here;
  float middle = InverseDepth(at), strength = 0.0, nearest = middle;
  for (int k = 0; k < 4; ++k) {
    ivec2 step = k == 0 ? ivec2(1, 0) : k == 1 ? ivec2(0, 1) : k == 2 ? ivec2(1, 1) : ivec2(1, -1);
    if (!Inside(at - step) || !Inside(at + step)) continue;
    float a = InverseDepth(at - step), b = InverseDepth(at + step), front = max(max(a, b), middle);
    nearest = max(nearest, front);
    if (front > 0.0) strength = max(strength, (abs(a - 2.0 * middle + b) / front - kLeastBend) / (kFullBend - kLeastBend));
  }
  if (!(strength > 0.0)) return;
  vec3 ray = vec3((gl_FragCoord.xy - novel_camera.zw) / novel_camera.xy, 1.0);
  strength = min(strength, 1.0) * Displacement(ray, nearest);
  vec4 mean = vec4(0.0);
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      if (!Inside(at + ivec2(x, y))) continue;
      float weight = (x == 0 ? 3.0 : 1.0) * (y == 0 ? 3.0 : 1.0);
      mean += weight * vec4(LinearFromSrgb(texelFetch(image, at + ivec2(x, y), 0).rgb), 1.0);
    }
  }
  out_image.rgb = SrgbFromLinear(mix(LinearFromSrgb(here.rgb), mean.rgb / mean.a, strength));
}
