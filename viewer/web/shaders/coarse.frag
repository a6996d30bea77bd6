// SPEC 5.1: depth alone. 1/z in the view over z in the image is linear on the screen; gl_FragCoord.w is 1/z there.
in float near_share;

void main() {
  gl_FragDepth = near_share * gl_FragCoord.w;
}
