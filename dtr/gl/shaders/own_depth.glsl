// SPEC 5.2, 5.3: how a view's full-resolution depth map votes on a surface at a pixel, and the
// view's own fragment there. Expects `depths`, an array of sampler2DArray laid out as PackedDepth
// (dtr/gl/packed_depth.h) says: one value per sample (0: none) that a view's OwnMap turns into 1/z,
// the last row and column once more, then which blocks are whole or all masked. Filtered to the nearest.
// No branch: software rasterisers run both sides of one anyway.
#include "deferred_limits.h"

struct OwnMap {
  vec4 grid;    // 1 / width, 1 / height of the layer; columns / 2, rows / 2 of the samples in it
  vec3 stored;  // 1/z of a stored value v: x + y v; z: a pixel of disparity (of 1/z)
  float largest_bits;  // what 1.0 stands for where values are bits
  int slot;     // of depths
  int layer;    // in it
};

// SPEC 5.2: how the views vote on a surface.
struct Votes {
  float support, against;
  float front;   // 1/z of the nearest whole patch of those that support it; 0: none
  float behind;  // 1/z of the nearest surface that a view sees through it; 0: none
  float total, heaviest;  // of the weights of all who see anything there, or a hole
  float of_heaviest;      // 1/z of that view's own surface; 0: none
};

// SPEC 5.2.
bool OneDecides(Votes votes) {
  return votes.of_heaviest > 0.0 && votes.heaviest > kDecidingShare * votes.total;
}

// On the map, whose first sample's centre is at 0.5; `q`: position, homogeneous.
bool IsOnMap(OwnMap map, vec3 q, vec2 position) {
  return q.z > 0.0 && all(lessThanEqual(abs(position - map.grid.zw), map.grid.zw));
}

#if DEPTH_ARRAYS == 1
#define DEPTHS(map) depths[0]
#else
#define DEPTHS(map) depths[map.slot]
#endif

// SPEC 5.3: the four samples right of and below `low` belong together. SPEC 5.2: or they are all
// masked, 0 in the map.
bool IsWholeBlock(OwnMap map, vec2 low) {
  ivec2 block = ivec2(low) + 1;
  int first_row = int(2.0 * map.grid.w) + 1;
  ivec3 texel = ivec3(block.x, first_row + block.y / 16, map.layer);
  uint bits = uint(texelFetch(DEPTHS(map), texel, 0).r * map.largest_bits + 0.5);
  return (bits >> uint(block.y % 16) & 1u) != 0u;
}

// At inverse depth w the pixel's ray is at (base + away w) on the view's grid of samples,
// homogeneous. SPEC 5.3: the inverse depth in the novel camera at which the ray meets the tangent
// of the bilinear patch around where `surface` lies, else the nearest sample, flat; 0: it meets
// none. `on_map`: the place is on the view's map; `whole`: a patch of four samples was there; `masked`:
// four masked ones were.
float OwnDepth(OwnMap map, vec3 base, vec3 away, float surface, out bool on_map, out bool whole,
               out bool masked) {
  vec3 q = base + away * surface;
  vec2 position = q.xy / q.z;
  on_map = surface > 0.0 && IsOnMap(map, q, position);
  position = on_map ? position : vec2(0.0);  // what is not a number addresses no texel
  vec2 low = floor(position - 0.5), share = position - 0.5 - low;
  // The corner between the four, so that rounding cannot choose others than `share` speaks of.
  vec4 s = textureGather(DEPTHS(map), vec3((low + 1.0) * map.grid.xy, map.layer)).wzxy;
  whole = IsWholeBlock(map, low);
  float top = mix(s.x, s.y, share.x), bottom = mix(s.z, s.w, share.x);
  vec2 column = share.x < 0.5 ? s.xz : s.yw;
  float stored = whole ? mix(top, bottom, share.y) : (share.y < 0.5 ? column.x : column.y);
  masked = whole && !(stored > 0.0);
  vec2 slope =
      (whole ? map.stored.y : 0.0) * vec2(mix(s.y - s.x, s.w - s.z, share.y), bottom - top);
  float own = map.stored.x + map.stored.y * stored;

  // The view's own 1/z at grid point q is w / q.z, so that plane . q = w on the tangent plane.
  vec3 plane = vec3(slope, own - dot(slope, position));
  float facing = 1.0 - dot(plane, away);
  float w = dot(plane, base) / facing;
  return on_map && stored > 0.0 && facing > 0.0 && w > 0.0 ? w : 0.0;
}

// The view's vote on `surface`, where its own patch lies at `seen` on the ray.
void AddVote(OwnMap map, float surface, float seen, bool whole, bool masked, bool on_map,
             float vote, inout Votes votes) {
  float nearer = seen - surface;
  bool hole = !(seen > 0.0);
  vote = on_map && !masked ? vote : 0.0;
  votes.total += vote;
  votes.of_heaviest = vote > votes.heaviest ? seen : votes.of_heaviest;
  votes.heaviest = max(votes.heaviest, vote);
  bool through = !hole && nearer < -kBehindPx * map.stored.z;
  bool supports = !hole && !through && nearer <= kSupportBeforePx * map.stored.z;
  votes.against += hole ? kHoleVote * vote : (through ? vote : 0.0);
  votes.support += supports ? vote : 0.0;
  bool near = supports && whole && nearer <= kFragmentBeforePx * map.stored.z;
  votes.front = max(votes.front, near ? seen : 0.0);
  votes.behind = max(votes.behind, on_map && through ? seen : 0.0);
}

// The view's fragment near `surface`, which the views support; 0 where this one shows another there, or
// none.
float Fragment(OwnMap map, vec3 base, vec3 away, float surface) {
  bool on_map, whole, masked;
  float w = OwnDepth(map, base, away, surface, on_map, whole, masked);
  float nearer = w - surface;
  bool found = w > 0.0 && nearer <= kFragmentBeforePx * map.stored.z &&
               nearer >= -kBehindPx * map.stored.z && base.z + away.z * w > 0.0;
  return found ? w : 0.0;
}
