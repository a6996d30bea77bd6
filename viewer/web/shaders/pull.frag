// SPEC 7.1, pull: a cell is the mean of its up to four children by their weights, its weight their sum, at most 1.
#include "colour.glsl"
uniform sampler2D finer;  // the finished image (with FINEST) or a level of this pyramid: linear light, alpha the weight
uniform ivec2 finer_size;

layout(location = 0) out vec4 out_cell;

void main() {
  ivec2 first = 2 * ivec2(gl_FragCoord.xy);
  vec4 sum = vec4(0.0);
  for (int k = 0; k < 4; ++k) {
    ivec2 at = first + ivec2(k & 1, k >> 1);
    if (any(greaterThanEqual(at, finer_size))) continue;
    vec4 cell = texelFetch(finer, at, 0);
#if FINEST
    cell = vec4(LinearFromSrgb(cell.rgb), cell.a > 0.5 ? 1.0 : 0.0);
#endif
    sum += vec4(cell.rgb * cell.a, cell.a);
  }
  out_cell = sum.a > 0.0 ? vec4(sum.rgb / sum.a, min(sum.a, 1.0)) : vec4(0.0);
}
