// What the canvas shows: the finished image, depth in false colours, or from a line on the nearest photo.
#include "view.glsl"
uniform sampler2D image;
uniform highp usampler2D depth;
uniform sampler2DArray images;
uniform vec2 image_from_canvas;  // pixels
uniform float canvas_height;
uniform vec4 novel_camera;       // of the image
uniform int show_depth;
uniform vec2 inverse_depths;     // nearest, farthest of the colours' range
uniform float photo_from_px;     // of the canvas; the photo is right of it
uniform vec3 exposure;           // the set's mean exposure to the photo's own
layout(std140) uniform Photo { View photo; };

#include "bilinear.glsl"
#include "colour.glsl"
layout(location = 0) out vec4 out_colour;

// Far: blue, over green and yellow, to near: red.
vec3 FalseColour(float t) {
  const vec3 kStops[5] = vec3[](vec3(0.16, 0.14, 0.50), vec3(0.12, 0.56, 0.80), vec3(0.36, 0.80, 0.42), vec3(0.97, 0.85, 0.26),
                                vec3(0.84, 0.17, 0.13));
  float at = 4.0 * t;
  int low = min(int(at), 3);
  return mix(kStops[low], kStops[low + 1], at - float(low));
}

// The photo as far as rotation alone brings it here: at its own place the photo itself.
vec3 PhotoAt(vec3 ray) {
  vec3 p = PointInView(photo, ray, 0.0);
  vec2 pixel = SourcePixel(photo, p);
  if (!(p.z > 0.0) || any(lessThan(pixel, vec2(0.0))) || any(greaterThan(pixel, photo.size.xy))) return vec3(0.09);
  ivec2 at = clamp(ivec2(pixel - 0.5), ivec2(0), ivec2(photo.size.xy) - 1);
  ivec2 next = min(at + 1, ivec2(photo.size.xy) - 1);
  vec2 share = clamp(pixel - 0.5 - vec2(at), 0.0, 1.0);
  int layer = int(photo.slots.x);
  vec3 colour = mix(mix(texelFetch(images, ivec3(at, layer), 0).rgb, texelFetch(images, ivec3(next.x, at.y, layer), 0).rgb, share.x),
                    mix(texelFetch(images, ivec3(at.x, next.y, layer), 0).rgb, texelFetch(images, ivec3(next, layer), 0).rgb, share.x),
                    share.y);
  vec3 linear = LinearFromSrgb(colour), e2 = exposure * exposure, v2 = linear * linear;
  return SrgbFromLinear(exposure * linear / sqrt(sqrt(1.0 + (e2 * e2 - 1.0) * v2 * v2)));
}

void main() {
  vec2 at = vec2(gl_FragCoord.x, canvas_height - gl_FragCoord.y);  // row 0 on top
  vec2 pixel = at * image_from_canvas;
  if (at.x >= photo_from_px) {
    bool line = at.x < photo_from_px + 2.0;
    out_colour = vec4(line ? vec3(1.0) : PhotoAt(vec3((pixel - novel_camera.zw) / novel_camera.xy, 1.0)), 1.0);
  } else if (show_depth != 0) {
    float w = uintBitsToFloat(texelFetch(depth, ivec2(pixel), 0).r);
    float t = (w - inverse_depths.y) / (inverse_depths.x - inverse_depths.y);
    out_colour = vec4(w > 0.0 ? FalseColour(clamp(t, 0.0, 1.0)) : vec3(0.0), 1.0);
  } else {
    out_colour = vec4(ImageAt(image, pixel), 1.0);
  }
}
