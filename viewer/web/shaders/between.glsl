// SPEC 7.1, push: the bilinear mean of the four coarse cells around a fine one, by their weights.
uniform sampler2D coarser;
uniform ivec2 coarser_size;

vec4 Between(ivec2 at) {
  ivec2 first = (at + 1) / 2 - 1;
  // A fine cell's centre lies a quarter of a coarse cell beside the coarse centre.
  vec2 share = vec2((at.x & 1) == 0 ? 0.75 : 0.25, (at.y & 1) == 0 ? 0.75 : 0.25);
  vec4 sum = vec4(0.0);
  for (int k = 0; k < 4; ++k) {
    ivec2 i = ivec2(k & 1, k >> 1), cell_at = first + i;
    if (any(lessThan(cell_at, ivec2(0))) || any(greaterThanEqual(cell_at, coarser_size))) continue;
    vec4 cell = texelFetch(coarser, cell_at, 0);
    float weight = cell.a * (i.x == 0 ? 1.0 - share.x : share.x) * (i.y == 0 ? 1.0 - share.y : share.y);
    sum += vec4(cell.rgb * weight, weight);
  }
  return sum.a > 0.0 ? vec4(sum.rgb / sum.a, 1.0) : vec4(0.0);
}
