// SPEC 4.2 to 4.8 and 6: how the views' nearest fragments are blended, pixel by pixel. One sum in
// the views' canonical order and one division: nothing depends on the order they were drawn in.
// Defines: MAX_VIEWS, IMAGE_ARRAYS, DEPTH_ARRAYS (0: two passes, else SPEC 5), BLEND, PER_PIXEL,
// LINEAR_LIGHT, EXPOSED, CLIPPED, VIEWS_IN_UNIFORMS.
layout(local_size_x = 8, local_size_y = 8) in;
#if DEPTH_ARRAYS
layout(std430, binding = 2) readonly buffer Depth { uint nearest[]; };  // SPEC 5.1
uniform sampler2DArray depths[DEPTH_ARRAYS];
#else
uniform sampler2DArray layers;  // near_z / z in the novel camera, a layer per view; 0: none
#endif
uniform sampler2DArray images[IMAGE_ARRAYS];
#include "deferred_limits.h"
#include "view_block.glsl"
#include "colour.glsl"
#include "weights.glsl"

// Uniforms where they suffice: software rasterisers read storage buffers lane by lane.
#if VIEWS_IN_UNIFORMS
layout(std140, binding = 0) uniform Views { ViewBlock views[MAX_VIEWS]; };
#else
layout(std430, binding = 0) readonly buffer Views { ViewBlock views[]; };
#endif

uniform int width_px, rows;    // of the band
uniform int view_count;
uniform int nearest_views;     // K, for the per-pixel rule
uniform vec4 novel_camera;     // fx, fy, cx, cy, pixels
uniform float first_row;       // of the band, pixels
uniform float absolute_delta;  // the report's Delta, scene units; negative: none

#if EXPOSED
uniform vec3 exposure;

// SPEC 4.9.
vec3 Exposed(vec3 linear) {
  vec3 e2 = exposure * exposure, v2 = linear * linear;
  return exposure * linear / sqrt(sqrt(1.0 + (e2 * e2 - 1.0) * v2 * v2));
}
#endif

layout(rgba8, binding = 0) writeonly uniform image2DArray image_result;
layout(r32f, binding = 1) writeonly uniform image2DArray depth_result;
layout(rgba8ui, binding = 2) writeonly uniform uimage2DArray marks_result;

vec4 out_image = vec4(0.0);   // sRGB; alpha 1 where seen
float out_depth = 0.0;        // plane z of the front surface
uvec4 out_marks = uvec4(0u);  // view count, 255 at the Delta border, unused

const float kLargestFloat = 3.4e38;
#if LINEAR_LIGHT
const float kSameSurface = 0.5;  // SPEC 4.4
#else
const float kSameSurface = 0.75;
#endif

float fragment[MAX_VIEWS];  // 1/z; 0: absent
float angle[MAX_VIEWS];     // SPEC 4.5, at the point
float log_weight[MAX_VIEWS], weight[MAX_VIEWS];

vec3 Centre(ViewBlock view) { return vec3(view.row_x.w, view.row_y.w, view.row_z.w); }

uniform float least_inverse_depth;  // SPEC 4.5

// t of SPEC 4.5 at the point ray / w, from vectors times w: no division, any scale (SPEC 1.1).
float AngleAt(ViewBlock view, vec3 ray, float w) {
  w = max(w, least_inverse_depth);
  vec3 to_view = Centre(view) * w - ray;
  return atan(length(cross(to_view, -ray)), dot(to_view, -ray));
}

// SPEC 4.4: the point in the view's frame, times w.
vec3 PointInView(ViewBlock view, vec3 ray, float w) {
  vec3 p = ray - Centre(view) * w;
  return view.row_x.xyz * p.x + view.row_y.xyz * p.y + view.row_z.xyz * p.z;
}

#if DEPTH_ARRAYS
#include "own_depth.glsl"

OwnMap MapOf(ViewBlock view) {
  return OwnMap(view.map, view.stored_depth.xyz, view.limits.w, view.depth_slot.x,
                view.depth_slot.y);
}

// A point of the view's frame on its grid of samples, homogeneous.
vec3 OnGrid(ViewBlock view, vec3 p) {
  return vec3(view.depth_grid.xy * p.xy + view.depth_grid.zw * p.z, p.z);
}
vec3 BaseOf(ViewBlock view, vec3 ray) { return OnGrid(view, PointInView(view, ray, 0.0)); }
vec3 AwayOf(ViewBlock view) { return OnGrid(view, PointInView(view, vec3(0.0), 1.0)); }

// 1 / (tan^2 t + t_pixel^2), t the angle of SPEC 4.5 at the point ray / w; 0 from 90 degrees on.
float VoteWeight(ViewBlock view, vec3 ray, float w) {
  w = max(w, least_inverse_depth);
  vec3 to_view = Centre(view) * w - ray;
  float along = dot(to_view, -ray);
  if (!(along > 0.0)) return 0.0;
  vec3 across = cross(to_view, ray);
  return 1.0 / (dot(across, across) / (along * along) + pixel_angle_rad * pixel_angle_rad);
}

// SPEC 5.2, 5.3: every view's fragment on the nearest surface that the views support.
bool FindOwnFragments(vec3 ray, float surface) {
  bool supported = false;
  for (int tried = 0; tried < kMaxSurfaces && surface > 0.0 && !supported; ++tried) {
    Votes votes = Votes(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (int i = 0; i < view_count; ++i) {
      ViewBlock view = views[i];
      OwnMap map = MapOf(view);
      bool on_map, whole, masked;
      float seen =
          OwnDepth(map, BaseOf(view, ray), AwayOf(view), surface, on_map, whole, masked);
      AddVote(map, surface, seen, whole, masked, on_map, VoteWeight(view, ray, surface), votes);
    }
    bool decided = OneDecides(votes);
    supported = decided || votes.support >= votes.against;
    float front = votes.front > 0.0 ? votes.front : surface;
    surface = decided ? votes.of_heaviest : supported ? front : votes.behind;
  }
  if (!supported) return false;
  for (int i = 0; i < view_count; ++i) {
    ViewBlock view = views[i];
    fragment[i] = Fragment(MapOf(view), BaseOf(view, ray), AwayOf(view), surface);
  }
  return true;
}
#endif

vec2 SourcePixel(ViewBlock view, vec3 p) { return view.camera.xy * (p.xy / p.z) + view.camera.zw; }

// SPEC 4.2: where Delta pushes a fragment; only the compared depth moves, and never nearer.
float Pushed(ViewBlock view, float w) {
  return absolute_delta < 0.0 ? w - view.limits.z : min(w, 1.0 / (1.0 / w + absolute_delta));
}

bool Exists(ViewBlock view, vec3 ray, float w) {
  if (!(w > 0.0) || !(1.0 / w > 0.0) || !(1.0 / w <= kLargestFloat)) return false;
#if PER_PIXEL
  if (AngleAt(view, ray, w) > max_angle_rad) return false;  // SPEC 1.3
#endif
  vec3 p = PointInView(view, ray, w);
  if (!(p.z > 0.0)) return false;
  return view.image.z == 0 || ColourAt(view, SourcePixel(view, p)).a > 0.0;
}

#if CLIPPED
// SPEC 4.4: how far a colour is clipped.
float ClippedShare(ViewBlock view, vec3 colour) {
  float greatest = max(max(colour.r, colour.g), colour.b), white = greatest * greatest * greatest * greatest;
#if !LINEAR_LIGHT
  white *= white;
#endif
  return view.fading.w * min(2.0 * white, 1.0);
}

// SPEC 4.4: the greatest value of each channel that a photo has at a point and did not clip.
vec3 Unclipped(vec3 ray, float w) {
  vec3 greatest = vec3(0.0);
  for (int i = 0; i < view_count; ++i) {
    ViewBlock view = views[i];
    vec3 p = PointInView(view, ray, w);
    vec2 pixel = SourcePixel(view, p);
    if (!(p.z > 0.0) || any(lessThan(pixel, vec2(0.0))) || any(greaterThanEqual(pixel, view.limits.xy))) continue;
    vec4 colour = ColourAt(view, pixel);
    if (colour.a > 0.0 && ClippedShare(view, colour.rgb) < 0.5) greatest = max(greatest, colour.rgb);
  }
  return greatest;
}

// SPEC 4.4: a clipped colour as others measured it, where they measured one.
vec3 Restored(ViewBlock view, vec3 colour, vec3 unclipped) {
  bool same = all(greaterThanEqual(unclipped, kSameSurface * colour));
  return same ? mix(colour, unclipped, ClippedShare(view, colour)) : colour;
}
#endif

// SPEC 1.4.
float CutFactor(float t, float cut) {
  return cut > 0.0 ? clamp((cut - t) / (0.25 * cut), kLeastFactor, 1.0) : 1.0;
}

// The rank-th smallest angle (0: the smallest) among the fragments that are left.
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

void Resolve(ivec2 target) {
  vec2 pixel = vec2(target) + 0.5 + vec2(0.0, first_row);
  vec3 ray = vec3((pixel - novel_camera.zw) / novel_camera.xy, 1.0);

  // SPEC 4.2: front and border.
#if DEPTH_ARRAYS
  float surface = uintBitsToFloat(nearest[target.y * width_px + target.x]);
  if (!FindOwnFragments(ray, surface)) return;
#endif
  float front = 0.0, border = -kLargestFloat;
  for (int i = 0; i < view_count; ++i) {
#if DEPTH_ARRAYS
    float w = fragment[i];
#else
    float depth = texelFetch(layers, ivec3(target, i), 0).r;
    float w = depth < 1.0 ? depth * views[i].stored_depth.y : 0.0;  // SPEC 2.5; beyond: rounding
#endif
    fragment[i] = 0.0;
    if (!(w > 0.0) || !Exists(views[i], ray, w)) continue;
    fragment[i] = w;
    front = max(front, w);
    border = max(border, Pushed(views[i], w));
  }
  if (!(front > 0.0)) return;
  out_depth = 1.0 / front;
#if CLIPPED
  vec3 unclipped = Unclipped(ray, front);
#endif

  // SPEC 4.3, with the same Delta.
  float margin = kBorderShare * (front - border);
  uint at_border = 0u;
  int left = 0;
  float smallest = kLargestFloat;
  for (int i = 0; i < view_count; ++i) {
    float w = fragment[i];
    if (w == 0.0) continue;
    if (abs(w - border) <= margin) at_border = 255u;
    if (w < border) {
      fragment[i] = 0.0;
      continue;
    }
    ++left;
    angle[i] = AngleAt(views[i], ray, w);
    smallest = min(smallest, angle[i]);
  }
#if PER_PIXEL
  float cut = max_angle_rad;  // SPEC 1.4
  if (left > nearest_views) {  // SPEC 1.3; views tied with the K-th stay
    float limit = RankedAngle(nearest_views - 1);
    cut = RankedAngle(nearest_views);
    left = 0;
    for (int i = 0; i < view_count; ++i) {
      if (fragment[i] == 0.0) continue;
      if (angle[i] > limit) fragment[i] = 0.0;
      else ++left;
    }
  }
#endif

  // SPEC 4.5, 4.6.
#if BLEND == K_NEAREST
  float next_angle = left <= blend_k ? max_angle_rad : RankedAngle(blend_k);
#else
  float next_angle = 0.0;
#endif
  float largest = kNoWeight;
  int blended = 0;
  for (int i = 0; i < view_count; ++i) {
    if (fragment[i] == 0.0) continue;
    log_weight[i] = LogWeight(angle[i], next_angle);
    if (log_weight[i] > kNoWeight) ++blended;
    largest = max(largest, log_weight[i]);
  }
  bool all_zero = blended == 0;  // then those at the smallest angle share

  float total = 0.0;
  for (int i = 0; i < view_count; ++i) {
    if (fragment[i] == 0.0) continue;
    weight[i] = all_zero ? (angle[i] == smallest ? 1.0 : 0.0)
                         : (log_weight[i] > kNoWeight ? exp(log_weight[i] - largest) : 0.0);
    if (all_zero && weight[i] > 0.0) ++blended;
    total += weight[i];
  }

  // SPEC 4.7, 4.8.
  vec4 sum = vec4(0.0);
  for (int i = 0; i < view_count; ++i) {
    if (fragment[i] == 0.0 || !(weight[i] > 0.0)) continue;
    ViewBlock view = views[i];
    vec4 colour = ColourAt(view, SourcePixel(view, PointInView(view, ray, fragment[i])));
#if CLIPPED
    colour.rgb = Restored(view, colour.rgb, unclipped);
#endif
    float factor = min(view.fading.y * colour.a + view.fading.z, 1.0);
#if PER_PIXEL
    factor *= CutFactor(angle[i], cut);
#else
    factor *= view.fading.x;
#endif
    sum += FadedWeight(weight[i], factor, total) * vec4(colour.rgb, 1.0);
  }
  vec3 mean = sum.rgb / sum.a;
#if EXPOSED
#if !LINEAR_LIGHT
  mean = LinearFromSrgb(clamp(mean, 0.0, 1.0));
#endif
  mean = SrgbFromLinear(Exposed(clamp(mean, 0.0, 1.0)));
#elif LINEAR_LIGHT
  mean = SrgbFromLinear(mean);
#endif
  out_image = vec4(clamp(mean, 0.0, 1.0), 1.0);
  out_marks = uvec4(uint(min(blended, 255)), at_border, 0u, 0u);
}

void main() {
  ivec2 target = ivec2(gl_GlobalInvocationID.xy);
  if (target.x >= width_px || target.y >= rows) return;
  Resolve(target);
  imageStore(image_result, ivec3(target, 0), out_image);
  imageStore(depth_result, ivec3(target, 0), vec4(out_depth, 0.0, 0.0, 0.0));
  imageStore(marks_result, ivec3(target, 0), out_marks);
}
