// capture/video/display_matrix.h -- how a video wants its frames to be rotated and mirrored.
#pragma once
#include <array>
#include <cstdint>
#include <optional>

namespace dtr::capture {

/// Matrix of ISO 14496-12 (6.2.2) in the order of the file, a b u c d v x y w: a point (p, q) of
/// the stored frame is shown at (a p + c q + x, b p + d q + y). Numbers are 16.16 fixed point.
using DisplayMatrix = std::array<std::int32_t, 9>;

/// The same rotation and mirroring as an EXIF orientation (1..8), whatever the scale and the
/// translation. Nothing where the matrix is degenerate or rotates by anything but quarters of a
/// full rotation.
std::optional<int> ExifOrientationOf(const DisplayMatrix& matrix);

}  // namespace dtr::capture
