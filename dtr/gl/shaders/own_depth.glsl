// SPEC 5.2, 5.3: what a view's full-resolution depth map says of a surface at a pixel, and the
// view's own fragment there. Expects `depths`, an array of sampler2DArray with one value per sample
// (0: none) that a view's OwnMap turns into 1/z, filtered to the nearest and clamped to the edge or
// with the edge once more.
// No branch: software rasterisers run both sides of one anyway.
struct OwnMap {
  vec4 grid;    // 1 / width, 1 / height of the layer; columns / 2, rows / 2 of the samples in it
  vec4 stored;  // 1/z of a stored value v: x + y v; depth break and pixel of disparity (of 1/z)
  int slot;     // of depths
  int layer;    // in it
};

// SPEC 5.2: what the views say of a surface.
struct Votes {
  float held, refused;
  float behind;  // 1/z of the nearest surface that a view sees through it; 0: none
};

const float kFirstBeforePx = 1.0, kBeforePx = 0.5, kBehindPx = 2.0, kSettledPx = 0.25;
const float kHoleSay = 0.25;
const int kTriedSurfaces = 3;

bool IsWithin(OwnMap map, float nearer, float before_px) {
  return nearer <= before_px * map.stored.w && nearer >= -kBehindPx * map.stored.w;
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

// At inverse depth w the pixel's ray is at (base + away w) on the view's grid of samples,
// homogeneous. The first step from `surface`: the inverse depth in the novel camera at which the
// ray meets the nearest sample, taken flat; 0: there is none. `on_map`: the view looks there at all.
float FirstStep(OwnMap map, vec3 base, vec3 away, float surface, out bool on_map) {
  vec3 q = base + away * surface;
  vec2 position = q.xy / q.z;
  on_map = surface > 0.0 && IsOnMap(map, q, position);
  position = on_map ? position : vec2(0.0);  // what is not a number addresses no texel
  float stored = textureLod(DEPTHS(map), vec3(position * map.grid.xy, map.layer), 0.0).r;
  float own = map.stored.x + map.stored.y * stored;
  float facing = 1.0 - own * away.z;
  return on_map && stored > 0.0 && facing > 0.0 ? own * base.z / facing : 0.0;
}

// The view's say of `surface`, where its first step led to `seen`.
void AddVote(OwnMap map, float surface, float seen, bool on_map, float say, inout Votes votes) {
  say = on_map ? say : 0.0;
  float nearer = seen - surface;
  bool hole = !(seen > 0.0);
  bool through = !hole && nearer < -kBehindPx * map.stored.w;
  bool holds = !hole && !through && nearer <= kFirstBeforePx * map.stored.w;
  votes.refused += hole ? kHoleSay * say : (through ? say : 0.0);
  votes.held += holds ? say : 0.0;
  votes.behind = max(votes.behind, on_map && through ? seen : 0.0);
}

// The second step, from where the first led: the inverse depth at which the ray meets the tangent
// of the bilinear patch where the four samples around belong together, else the nearest sample; 0
// where the view shows another surface there, or none. `position`: of the fragment, on the grid.
float SecondStep(OwnMap map, vec3 base, vec3 away, float surface, float first, out vec2 position) {
  vec3 q = base + away * first;
  position = q.xy / q.z;
  bool found = first > 0.0 && IsWithin(map, first - surface, kFirstBeforePx) &&
               IsOnMap(map, q, position);
  position = found ? position : vec2(0.0);

  vec2 low = floor(position - 0.5), share = position - 0.5 - low;
  // The corner between the four, so that rounding cannot choose others than `share` speaks of.
  vec4 s = textureGather(DEPTHS(map), vec3((low + 1.0) * map.grid.xy, map.layer)).wzxy;
  float lowest = min(min(s.x, s.y), min(s.z, s.w)), highest = max(max(s.x, s.y), max(s.z, s.w));
  bool whole = lowest > 0.0 && map.stored.y * (highest - lowest) <= map.stored.z;
  float top = mix(s.x, s.y, share.x), bottom = mix(s.z, s.w, share.x);
  vec2 column = share.x < 0.5 ? s.xz : s.yw;
  float stored = whole ? mix(top, bottom, share.y) : (share.y < 0.5 ? column.x : column.y);
  vec2 slope =
      (whole ? map.stored.y : 0.0) * vec2(mix(s.y - s.x, s.w - s.z, share.y), bottom - top);
  float own = map.stored.x + map.stored.y * stored;

  // The view's own 1/z at grid point q is w / q.z, so that plane . q = w on the tangent plane.
  vec3 plane = vec3(slope, own - dot(slope, position));
  float facing = 1.0 - dot(plane, away);
  float w = dot(plane, base) / facing;
  q = base + away * w;
  position = q.xy / q.z;
  // The first step took the nearest sample flat: half a sample's slope is its error.
  float room = kSettledPx * map.stored.w + 0.5 * (abs(slope.x) + abs(slope.y));
  found = found && stored > 0.0 && facing > 0.0 && w > 0.0 &&
          IsWithin(map, w - surface, kBeforePx) && abs(w - first) <= room && q.z > 0.0;
  position = found ? position : vec2(0.0);
  return found ? w : 0.0;
}
