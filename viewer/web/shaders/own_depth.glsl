// SPEC 5.2, 5.3: how a view votes on a surface at a pixel, and its own fragment there.
uniform usampler2DArray depths;  // codes, a layer per view; 0: no depth
uniform usampler2DArray blocks;  // of samples, shifted by one: bit 0 whole, bit 1 all masked
#include "deferred_limits.h"

struct Votes {
  float support, against;
  float front;   // 1/z of the nearest whole patch of those that support the surface; 0: none
  float behind;  // 1/z of the nearest surface that a view sees through it; 0: none
  float total, heaviest;  // weights of all that see anything there, or a hole
  float of_heaviest;      // 1/z of that view's own surface; 0: none
};

bool OneDecides(Votes votes) { return votes.of_heaviest > 0.0 && votes.heaviest > kDecidingShare * votes.total; }

// 1/z of a sample; 0: none.
float SampleAt(View view, ivec2 at) {
  ivec2 inside = clamp(at, ivec2(0), ivec2(view.size.zw) - 1);
  float code = float(texelFetch(depths, ivec3(inside, int(view.slots.x)), 0).r);
  float first = code - view.slots.z;
  return code == 0.0 ? 0.0 : first > 0.0 ? view.codes.z + view.codes.w * first : view.codes.x + view.codes.y * code;
}

struct Own {
  float w;  // 1/z in the novel camera where the ray meets the view's surface; 0: it meets none
  bool on_map, whole, masked;
};

// A point of the view's frame on its grid of samples, homogeneous.
vec3 OnGrid(View view, vec3 p) { return vec3(view.depth_grid.xy * p.xy + view.depth_grid.zw * p.z, p.z); }

// At inverse depth w the ray is at (base + away w) on the view's grid.
Own OwnDepth(View view, vec3 base, vec3 away, float surface) {
  Own own = Own(0.0, false, false, false);
  vec3 q = base + away * surface;
  vec2 position = q.xy / q.z;
  own.on_map = surface > 0.0 && q.z > 0.0 && all(greaterThanEqual(position, vec2(0.0))) && all(lessThanEqual(position, view.size.zw));
  if (!own.on_map) return own;
  vec2 low = floor(position - 0.5), share = position - 0.5 - low;
  ivec2 corner = ivec2(low);
  uint flags = texelFetch(blocks, ivec3(corner + 1, int(view.slots.x)), 0).r;
  own.whole = (flags & 1u) != 0u;
  own.masked = (flags & 2u) != 0u;
  vec3 plane;  // the view's own 1/z at grid point q is w / q.z: plane . q = w on its tangent plane
  if (own.whole) {
    float a = SampleAt(view, corner), b = SampleAt(view, corner + ivec2(1, 0));
    float c = SampleAt(view, corner + ivec2(0, 1)), d = SampleAt(view, corner + 1);
    float top = mix(a, b, share.x), bottom = mix(c, d, share.x);
    vec2 slope = vec2(mix(b - a, d - c, share.y), bottom - top);
    plane = vec3(slope, mix(top, bottom, share.y) - dot(slope, position));
  } else {
    float nearest = SampleAt(view, corner + ivec2(share.x < 0.5 ? 0 : 1, share.y < 0.5 ? 0 : 1));
    if (!(nearest > 0.0)) return own;
    plane = vec3(0.0, 0.0, nearest);
  }
  float facing = 1.0 - dot(plane, away), w = dot(plane, base) / facing;
  own.w = facing > 0.0 && w > 0.0 ? w : 0.0;
  return own;
}

void AddVote(View view, float surface, Own own, float vote, inout Votes votes) {
  if (!own.on_map || own.masked) return;
  float pixel = view.slots.w, nearer = own.w - surface;
  bool hole = !(own.w > 0.0);
  votes.total += vote;
  if (vote > votes.heaviest) {
    votes.heaviest = vote;
    votes.of_heaviest = own.w;
  }
  if (hole) {
    votes.against += kHoleVote * vote;
  } else if (nearer < -kBehindPx * pixel) {
    votes.against += vote;
    votes.behind = max(votes.behind, own.w);
  } else if (nearer <= kSupportBeforePx * pixel) {
    votes.support += vote;
    if (own.whole && nearer <= kFragmentBeforePx * pixel) votes.front = max(votes.front, own.w);
  }
}

// The view's fragment near a surface that the views support; 0: it shows another, or none.
float Fragment(View view, vec3 base, vec3 away, float surface) {
  float w = OwnDepth(view, base, away, surface).w, nearer = w - surface;
  bool found = w > 0.0 && nearer <= kFragmentBeforePx * view.slots.w && nearer >= -kBehindPx * view.slots.w &&
               base.z + away.z * w > 0.0;
  return found ? w : 0.0;
}
