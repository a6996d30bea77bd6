// dtr/render/deferred_limits.h -- limits of SPEC 5.2, 5.3 and 6.2. One text: C++ and GLSL read it.
#ifdef __cplusplus
#pragma once
namespace dtr {
#endif

// SPEC 5.2: a view supports a surface that its own depth lies at most so far before, and at most
// so far behind. Pixels of disparity.
const float kSupportBeforePx = 1.0f;
const float kBehindPx = 2.0f;
// SPEC 5.2, 5.3: a view's own fragment lies at most so far before the surface. Pixels of disparity.
const float kFragmentBeforePx = 0.5f;
// SPEC 5.2: the vote of a hole against a surface; a depth behind the surface votes with 1.
const float kHoleVote = 0.25f;
// SPEC 5.2: a view with more than this share of all votes' weight decides alone.
const float kDecidingShare = 0.9f;
// SPEC 5.2: surfaces of a pixel that are voted on, at most.
const int kMaxSurfaces = 3;
// SPEC 6.2: renderers that agree on depth to single precision may differ on fragments this near to
// the border, a share of Delta.
const float kBorderShare = 1e-4f;

#ifdef __cplusplus
}  // namespace dtr
#endif
