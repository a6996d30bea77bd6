#include "pipeline/export/detail/photo_depth.h"

#include "calib/undistort.h"
#include "dtr/base/parallel_for.h"

namespace dtr::pipeline {

DepthPlanes PlanesOnPhoto(const SurfaceView& surface, const calib::LensCamera& lens,
                          DepthKind kind) {
  const int width = lens.width_px, height = lens.height_px;
  DepthPlanes planes{DepthImage(width, height, kind), Grid<float>(width, height),
                     Mask(width, height)};
  const calib::LensMap map(lens);
  ParallelFor(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const auto pixel = calib::UndistortedPixel(map, surface.camera, {x + 0.5, y + 0.5});
      if (!pixel || !surface.camera.Contains(*pixel)) continue;
      const auto w = surface.InverseDepthAt(*pixel);
      if (!w) continue;
      const double length =
          kind == DepthKind::kRayDistance ? surface.camera.RayFromPixel(*pixel).norm() : 1;
      const bool completed =
          surface.IsCompleted(static_cast<int>(pixel->x()), static_cast<int>(pixel->y()));
      planes.depth(x, y) = static_cast<float>(length / *w);
      planes.sigma(x, y) =
          completed ? 0.0f : static_cast<float>(length * surface.SigmaAt(*pixel) / (*w * *w));
      planes.validity(x, y) = completed ? DepthPlanes::kCompleted : DepthPlanes::kMeasured;
    }
  });
  return planes;
}

}  // namespace dtr::pipeline
