#include "dtr/simd/coarse_raster.h"

#include <algorithm>

#include "dtr/base/parallel_for.h"

namespace dtr::simd {
namespace {

// Strips of rows are drawn at once; thinner ones would set up too many triangles twice.
constexpr int kMinRows = 64;

}  // namespace

void CoarseRaster::Draw(const std::vector<PlacedMesh>& meshes, int width_px, const Band& band) {
  points_.resize(meshes.size());
  ParallelFor(0, static_cast<int>(meshes.size()), [&](int i) {
    const auto k = static_cast<size_t>(i);
    ProjectVertices(*meshes[k].mesh, meshes[k].placement, points_[k]);
  });
  nearest_.assign(static_cast<size_t>(width_px) * static_cast<size_t>(band.count), 0);
  const int most = std::max(1, band.count / kMinRows);
  const int strips = std::min(most, ThreadLimit::Current());
  ParallelFor(0, strips, [&](int s) {
    const int from = static_cast<int>(static_cast<long long>(band.count) * s / strips);
    const int to = static_cast<int>(static_cast<long long>(band.count) * (s + 1) / strips);
    const CoarseStrip strip{
        nearest_.data() + static_cast<size_t>(from) * static_cast<size_t>(width_px), width_px,
        band.first + from, band.first + to - 1};
    for (size_t k = 0; k < meshes.size(); ++k) {
      DrawIntoStrip(*meshes[k].mesh, meshes[k].placement, points_[k], strip);
    }
  });
}

}  // namespace dtr::simd
