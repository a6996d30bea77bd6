// dtr/simd/window_depth.h -- depth as a host's depth buffer has it, of an image in memory, with
// the processor's vector instructions.
#pragma once
#include <cstdint>
#include <span>

namespace dtr::simd {

/// Plane z to the host's depth buffer, all of it in single precision.
struct WindowDepthMapping {
  float at_infinity = 1, per_inverse_depth = 0;  ///< as DepthProjection
  float least = -1, scale = 0.5f;  ///< window z from 0 to 1 = (device z - least) * scale
  float near = 0, difference = 1;  ///< glDepthRange: of window z 0, and from there to that of 1
  bool clamps = false;             ///< GL_DEPTH_CLAMP: nothing is clipped
  bool operator==(const WindowDepthMapping&) const = default;
};

/// What is drawn nowhere: a hole, or what the host's near or far plane cuts off.
inline constexpr float kNoWindowDepth = -1;

/// For each plane z (scene units, 0: a hole) the value for the depth buffer, or kNoWindowDepth.
/// Where `filled` is not empty, as long as `depth_z`, and not 0, a depth is of a filled pixel: it
/// is not cut off but lies within the planes, before what is cleared to the far one, be that window
/// z 1 or, of a reversed projection, 0, where the buffer has 24 bits or more.
void MapToWindow(const WindowDepthMapping& mapping, std::span<const float> depth_z,
                 std::span<const std::uint8_t> filled, std::span<float> window_z);

}  // namespace dtr::simd
