// What resolve.frag does for the deferred method, for the frames that QuickResolver draws: every
// view in one array of images and one of depths, no per-pixel rule, weights that are never 0. Made
// for software rasterisers, where a uniform costs as much as ten products and every branch is
// taken: a fragment is eight pixels one after another, so that each uniform is read once for eight;
// views are spelled out instead of looped over, but pixels are not, for then the code would no
// longer fit the processor's cache; and colours are mixed by the texture unit.
// Defines: VIEWS, FOR_EACH_VIEW(X): X(0) X(1) ..., BLEND, INVERSE_SQUARE (1: INVERSE_ANGLE, k = 2).
#define DEPTH_ARRAYS 1
uniform sampler2DArray depths[1];
uniform sampler2DArray images;
#include "quick_pixels.glsl"
#include "quick_block.glsl"
#include "own_depth.glsl"
#include "weights.glsl"

layout(std140, binding = 0) uniform Views { QuickBlock views[VIEWS]; };
uniform vec4 novel_camera;  // fx, fy, cx, cy, pixels
uniform float first_row;    // of the band, pixels

// A row of pixels each, the left one first; see resolve.frag for their meaning.
layout(location = 0) out uvec4 out_image[kDown];
layout(location = 2) out vec4 out_depth[kDown];
layout(location = 4) out uvec4 out_marks[kDown];

const float kBorderShare = 1e-4;  // SPEC 6.2
// SPEC 6.1: inverse depths whose depth float32 holds as a normal number.
const float kLeast = 1e-37, kMost = 1e37, kFar = -3.4e38;

QuickBlock view[VIEWS];  // read once
float ray_x, ray_y, ray_squared;
float surface, front, border;
float inverse_depth[VIEWS];  // 1/z of the views' fragments; 0: absent
vec2 texture_at[VIEWS];      // where the fragments lie on the images
Votes votes;
vec4 sum;
uint blended, at_border;

// Arrays hold one size: what follows from it is that of the first view.
OwnMap MapOf(int i) { return OwnMap(view[0].map, view[i].stored, 0, int(view[i].limits.z)); }
vec3 AwayOf(int i) { return vec3(view[i].grid_x.w, view[i].grid_y.w, view[i].grid_z.w); }
// From a ray to the grid at inverse depth 0.
vec3 BaseOf(int i) {
  return vec3(view[i].grid_x.x, view[i].grid_y.x, view[i].grid_z.x) * ray_x +
         (vec3(view[i].grid_x.y, view[i].grid_y.y, view[i].grid_z.y) * ray_y +
          vec3(view[i].grid_x.z, view[i].grid_y.z, view[i].grid_z.z));
}

// Across squared and along the ray, times a common factor that needs no division: tan t = across /
// along at the point (SPEC 4.5). From the view's centre, so that nothing cancels where t is small.
vec2 AcrossSquaredAndAlong(vec4 centre, float w) {
  float c = centre.x * ray_x + centre.y * ray_y + centre.z;
  return vec2(w * w * max(centre.w * ray_squared - c * c, 0.0), ray_squared - w * c);
}

// SPEC 5.2. Leaves the first steps in inverse_depth.
void AskView(const int i) {
  OwnMap map = MapOf(i);
  vec4 centre = view[i].centre;
  bool on_map;
  float seen = FirstStep(map, BaseOf(i), AwayOf(i), surface, on_map);
  inverse_depth[i] = seen;
  vec2 angle = AcrossSquaredAndAlong(centre, surface);
  float along_squared = angle.y * angle.y;
  float say = angle.y > 0.0
                  ? along_squared /
                        (angle.x + pixel_angle_rad * pixel_angle_rad * along_squared)
                  : 0.0;
  AddVote(map, surface, seen, on_map, say, votes);
}

// SPEC 5.3 and 4.2.
void FindFragments(const int i) {
  OwnMap map = MapOf(i);
  vec4 colour = view[0].colour;
  float delta = view[i].limits.x;
  vec2 position;
  float w = SecondStep(map, BaseOf(i), AwayOf(i), surface, inverse_depth[i], position);
  w = w >= kLeast && w <= kMost ? w : 0.0;
  inverse_depth[i] = w;
  texture_at[i] = position * colour.xy + colour.zw;
  front = max(front, w);
  border = max(border, w > 0.0 ? w - delta : kFar);
}

// The angle of (along, across), across >= 0; off by less than 3e-5 of itself (minimax polynomial),
// far below what shows in 8 bits.
float QuickAngle(float across, float along) {
  float least = min(across, abs(along)), most = max(across, abs(along));
  float a = least / most, s = a * a;
  float angle = a * (0.99997726 + s * (-0.33262347 + s * (0.19354346 +
                s * (-0.11643287 + s * (0.05265332 - s * 0.01172120)))));
  angle = across > abs(along) ? 1.57079632679 - angle : angle;
  return along < 0.0 ? 3.14159265359 - angle : angle;
}

float WeightAt(vec2 angle) {
  float t = QuickAngle(sqrt(angle.x), angle.y);
#if INVERSE_SQUARE
  float distance = t + pixel_angle_rad;
  return 1.0 / (distance * distance);
#else
  return exp(LogWeight(t, 0.0));
#endif
}

// SPEC 4.3 to 4.7.
void Blend(const int i) {
  vec4 centre = view[i].centre;
  float layer = view[i].limits.y;
  float w = inverse_depth[i];
  bool shown = w > 0.0 && w >= border;
  float weight = WeightAt(AcrossSquaredAndAlong(centre, w));
  vec3 colour = textureLod(images, vec3(texture_at[i], layer), 0.0).rgb;
  sum += (shown ? weight : 0.0) * vec4(colour, 1.0);
  blended += shown ? 1u : 0u;
  at_border |= abs(w - border) <= kBorderShare * (front - border) ? 0xff00u : 0u;
}

void Start(ivec2 at, int k) {
  ivec2 pixel = PixelAt(at, k);
  ray_x = (float(pixel.x) + 0.5 - novel_camera.z) / novel_camera.x;
  ray_y = (float(pixel.y) + 0.5 + first_row - novel_camera.w) / novel_camera.y;
  ray_squared = ray_x * ray_x + ray_y * ray_y + 1.0;
  surface = SurfaceAt(at, k);
  front = 0.0;
  border = kFar;
  sum = vec4(0.0);
  blended = 0u;
  at_border = 0u;
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
#define READ_VIEW(I) view[I] = views[I];
  FOR_EACH_VIEW(READ_VIEW)
  for (int j = 0; j < kDown; ++j) {
    out_image[j] = uvec4(0u);
    out_depth[j] = vec4(0.0);
    out_marks[j] = uvec4(0u);
  }
  for (int k = 0; k < N; ++k) {
    Start(at, k);
    bool held = false;
    for (int tried = 0; tried < kTriedSurfaces; ++tried) {
      votes = Votes(0.0, 0.0, 0.0);
#define ASK_VIEW(I) AskView(I);
      FOR_EACH_VIEW(ASK_VIEW)
      held = votes.held >= votes.refused;
      surface = held ? surface : votes.behind;
      if (held || !(surface > 0.0)) break;
    }
    surface = held ? surface : 0.0;

#define FIND_FRAGMENTS(I) FindFragments(I);
    FOR_EACH_VIEW(FIND_FRAGMENTS)
#define BLEND_VIEW(I) Blend(I);
    FOR_EACH_VIEW(BLEND_VIEW)

    bool seen = front > 0.0;
    uvec3 rgb = uvec3(clamp(sum.rgb / sum.a, 0.0, 1.0) * 255.0 + 0.5);
    uint image = seen ? rgb.r | rgb.g << 8 | rgb.b << 16 | 0xff000000u : 0u;
    float depth = seen ? 1.0 / front : 0.0;
    uint marks = seen ? blended | at_border : 0u;
    for (int j = 0; j < N; ++j) {
      out_image[j / kAcross][j % kAcross] = j == k ? image : out_image[j / kAcross][j % kAcross];
      out_depth[j / kAcross][j % kAcross] = j == k ? depth : out_depth[j / kAcross][j % kAcross];
      out_marks[j / kAcross][j % kAcross] = j == k ? marks : out_marks[j / kAcross][j % kAcross];
    }
  }
}
