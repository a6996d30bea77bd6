// SPEC 7.1, push: cells that are known stay, others come from the level above.
#include "between.glsl"
uniform sampler2D pulled;

layout(location = 0) out vec4 out_cell;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 cell = texelFetch(pulled, at, 0);
  out_cell = cell.a > 0.0 ? cell : Between(at);
}
