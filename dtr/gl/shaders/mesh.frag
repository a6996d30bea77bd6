// SPEC 2.4: inverse depth in the novel camera. The largest value stays (blend equation MAX): each
// view gives at each pixel its nearest fragment (SPEC 4.2), whatever the order of its triangles.
in float view_inverse_depth;

uniform float largest_inverse_depth;  // 1 / near: beyond it is rounding on a sliver

layout(location = 0) out float inverse_depth;

void main() {
  // w / q.z is linear on the screen; gl_FragCoord.w is the interpolated 1 / q.z.
  float w = view_inverse_depth * gl_FragCoord.w;
  inverse_depth = w > 0.0 && w <= largest_inverse_depth ? w : 0.0;
}
