// SPEC 4.2 to 4.9, 5.2 and 5.3: the surface of a pixel, every view's fragment on it, and their mean.
// Defines: MAX_VIEWS, PER_PIXEL (SPEC 1.3).
#include "view.glsl"
#include "own_depth.glsl"
#include "colour.glsl"

layout(std140) uniform Views { View views[MAX_VIEWS]; };
uniform sampler2DArray images;     // as prepare.frag made them
uniform sampler2D coarse;          // SPEC 5.1: least_near_z / z; 0: nothing
uniform float least_near_z;        // scene units
uniform int view_count;
uniform int nearest_views;         // K
uniform vec4 novel_camera;         // fx, fy, cx, cy, pixels
uniform float max_angle_rad;
uniform float pixel_angle_rad;     // t_pixel
uniform float least_inverse_depth; // SPEC 4.5
uniform vec3 exposure;             // SPEC 4.9

layout(location = 0) out vec4 out_image;  // sRGB; alpha 1 where seen
layout(location = 1) out uint out_depth;  // bits of 1/z of the front surface

const float kLeastFactor = 1.0 / 255.0;

float fragment[MAX_VIEWS];  // 1/z; 0: absent
float angle[MAX_VIEWS];     // SPEC 4.5, at the point

// Vectors times w: no division, any scale.
float AngleAt(View view, vec3 ray, float w) {
  w = max(w, least_inverse_depth);
  vec3 to_view = Centre(view) * w - ray;
  return atan(length(cross(to_view, -ray)), dot(to_view, -ray));
}

// SPEC 5.2.
float VoteWeight(View view, vec3 ray, float w) {
  w = max(w, least_inverse_depth);
  vec3 to_view = Centre(view) * w - ray;
  float along = dot(to_view, -ray);
  if (!(along > 0.0)) return 0.0;
  vec3 across = cross(to_view, ray);
  return 1.0 / (dot(across, across) / (along * along) + pixel_angle_rad * pixel_angle_rad);
}

bool FindFragments(vec3 ray, float surface) {
  bool supported = false;
  for (int tried = 0; tried < kMaxSurfaces && surface > 0.0 && !supported; ++tried) {
    Votes votes = Votes(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (int i = 0; i < view_count; ++i) {
      View view = views[i];
      vec3 base = OnGrid(view, PointInView(view, ray, 0.0)), away = OnGrid(view, PointInView(view, vec3(0.0), 1.0));
      AddVote(view, surface, OwnDepth(view, base, away, surface), VoteWeight(view, ray, surface), votes);
    }
    bool decided = OneDecides(votes);
    supported = decided || votes.support >= votes.against;
    float front = votes.front > 0.0 ? votes.front : surface;
    surface = decided ? votes.of_heaviest : supported ? front : votes.behind;
  }
  if (!supported) return false;
  for (int i = 0; i < view_count; ++i) {
    View view = views[i];
    vec3 base = OnGrid(view, PointInView(view, ray, 0.0)), away = OnGrid(view, PointInView(view, vec3(0.0), 1.0));
    fragment[i] = Fragment(view, base, away, surface);
  }
  return true;
}

// SPEC 4.4: colour and the factor of SPEC 4.8; all 0 where every pixel around is masked.
vec4 ColourAt(View view, vec2 pixel) {
  vec2 position = clamp(pixel - 0.5, vec2(0.0), view.size.xy - 1.0);
  ivec2 low = ivec2(position), high = min(low + 1, ivec2(view.size.xy) - 1);
  vec2 share = position - vec2(low);
  int layer = int(view.slots.x);
  vec4 colour = mix(mix(texelFetch(images, ivec3(low, layer), 0), texelFetch(images, ivec3(high.x, low.y, layer), 0), share.x),
                    mix(texelFetch(images, ivec3(low.x, high.y, layer), 0), texelFetch(images, ivec3(high, layer), 0), share.x),
                    share.y);
  return colour.a > 0.0 ? vec4(colour.rgb, max(colour.a, kLeastFactor)) : vec4(0.0);
}

bool Exists(View view, vec3 ray, float w) {
  if (!(w > 0.0)) return false;
#if PER_PIXEL
  if (AngleAt(view, ray, w) > max_angle_rad) return false;
#endif
  vec3 p = PointInView(view, ray, w);
  return p.z > 0.0 && (view.slots.y == 0.0 || ColourAt(view, SourcePixel(view, p)).a > 0.0);
}

// SPEC 4.4: how far a colour is clipped.
float ClippedShare(View view, vec3 colour) {
  float greatest = max(max(colour.r, colour.g), colour.b), white = greatest * greatest * greatest * greatest;
  return view.fading.w * min(2.0 * white * white, 1.0);
}

// SPEC 4.4: the greatest value of each channel that a photo has at a point and did not clip.
vec3 Unclipped(vec3 ray, float w) {
  vec3 greatest = vec3(0.0);
  for (int i = 0; i < view_count; ++i) {
    View view = views[i];
    vec3 p = PointInView(view, ray, w);
    vec2 pixel = SourcePixel(view, p);
    if (!(p.z > 0.0) || any(lessThan(pixel, vec2(0.0))) || any(greaterThanEqual(pixel, view.size.xy))) continue;
    vec4 colour = ColourAt(view, pixel);
    if (colour.a > 0.0 && ClippedShare(view, colour.rgb) < 0.5) greatest = max(greatest, colour.rgb);
  }
  return greatest;
}

// The rank-th smallest angle among the fragments that are left; 0: the smallest.
float RankedAngle(int rank) {
  for (int i = 0; i < view_count; ++i) {
    if (fragment[i] == 0.0) continue;
    int smaller = 0, equal = 0;
    for (int j = 0; j < view_count; ++j) {
      if (fragment[j] == 0.0) continue;
      smaller += angle[j] < angle[i] ? 1 : 0;
      equal += angle[j] == angle[i] ? 1 : 0;
    }
    if (smaller <= rank && rank < smaller + equal) return angle[i];
  }
  return max_angle_rad;
}

// SPEC 4.9.
vec3 Exposed(vec3 linear) {
  vec3 e2 = exposure * exposure, v2 = linear * linear;
  return exposure * linear / sqrt(sqrt(1.0 + (e2 * e2 - 1.0) * v2 * v2));
}

void main() {
  vec3 ray = vec3((gl_FragCoord.xy - novel_camera.zw) / novel_camera.xy, 1.0);
  out_image = vec4(0.0);
  out_depth = 0u;
  float surface = texelFetch(coarse, ivec2(gl_FragCoord.xy), 0).r / least_near_z;
  if (!FindFragments(ray, surface)) return;

  // SPEC 4.2.
  float front = 0.0, border = -1e38;
  for (int i = 0; i < view_count; ++i) {
    float w = fragment[i];
    fragment[i] = 0.0;
    if (!Exists(views[i], ray, w)) continue;
    fragment[i] = w;
    front = max(front, w);
    border = max(border, w - views[i].slots.w);  // Delta is one pixel of disparity
  }
  if (!(front > 0.0)) return;
  out_depth = floatBitsToUint(front);

  vec3 unclipped = exposure == vec3(1.0) ? vec3(0.0) : Unclipped(ray, front);

  // SPEC 4.3.
  int left = 0;
  for (int i = 0; i < view_count; ++i) {
    if (fragment[i] < border) fragment[i] = 0.0;
    if (fragment[i] == 0.0) continue;
    ++left;
    angle[i] = AngleAt(views[i], ray, fragment[i]);
  }
#if PER_PIXEL
  float cut = max_angle_rad;
  if (left > nearest_views) {  // SPEC 1.3; views tied with the K-th stay
    float limit = RankedAngle(nearest_views - 1);
    cut = RankedAngle(nearest_views);
    for (int i = 0; i < view_count; ++i) {
      if (fragment[i] != 0.0 && angle[i] > limit) fragment[i] = 0.0;
    }
  }
#endif

  // SPEC 4.5 (inverse-angle, k = 2), 4.6: weights relative to the largest.
  float smallest = 1e38, total = 0.0;
  for (int i = 0; i < view_count; ++i) {
    if (fragment[i] != 0.0) smallest = min(smallest, angle[i]);
  }
  for (int i = 0; i < view_count; ++i) {
    if (fragment[i] == 0.0) continue;
    float share = (smallest + pixel_angle_rad) / (angle[i] + pixel_angle_rad);
    total += share * share;
  }

  // SPEC 4.7, 4.8.
  vec4 sum = vec4(0.0);
  for (int i = 0; i < view_count; ++i) {
    if (fragment[i] == 0.0) continue;
    View view = views[i];
    vec4 colour = ColourAt(view, SourcePixel(view, PointInView(view, ray, fragment[i])));
    float share = (smallest + pixel_angle_rad) / (angle[i] + pixel_angle_rad), weight = share * share;
    if (all(greaterThanEqual(unclipped, 0.75 * colour.rgb))) {  // SPEC 4.4: one surface
      colour.rgb = mix(colour.rgb, unclipped, ClippedShare(view, colour.rgb));
    }
    float factor = min(view.fading.y * colour.a + view.fading.z, 1.0);
#if PER_PIXEL
    factor *= cut > 0.0 ? clamp((cut - angle[i]) / (0.25 * cut), kLeastFactor, 1.0) : 1.0;
#else
    factor *= view.fading.x;
#endif
    float others = max(total - weight, 0.0) + 1e-6 * total;
    sum += weight * factor * others / (others + (1.0 - factor) * weight) * vec4(colour.rgb, 1.0);
  }
  vec3 mean = clamp(sum.rgb / sum.a, 0.0, 1.0);
  if (exposure != vec3(1.0)) mean = SrgbFromLinear(Exposed(LinearFromSrgb(floor(mean * 255.0 + 0.5) / 255.0)));
  out_image = vec4(mean, 1.0);
}
