#include "dtr/advise/coarse_view.h"

#include <algorithm>
#include <cmath>

#include "dtr/types/area_average.h"

namespace dtr::advise {

CoarseView MakeCoarse(const View& view, int side_px) {
  CoarseView coarse;
  coarse.name = view.name;
  coarse.cam_from_world = view.cam_from_world;
  const PinholeCamera fine = view.DepthCamera();
  const auto [width, height] = TargetSize(fine.width_px(), fine.height_px(), side_px);
  coarse.camera = fine.Resized(width, height);
  coarse.pixel_of_fine = static_cast<double>(view.camera.width_px()) / width;
  coarse.depth = DepthImage(width, height, DepthKind::kPlaneZ);
  for (int y = 0; y < height; ++y) {
    const int from_y =
        std::min(fine.height_px() - 1, static_cast<int>((y + 0.5) * fine.height_px() / height));
    for (int x = 0; x < width; ++x) {
      const int from_x =
          std::min(fine.width_px() - 1, static_cast<int>((x + 0.5) * fine.width_px() / width));
      coarse.depth(x, y) = view.depth(from_x, from_y);
    }
  }
  return coarse;
}

Visibility VisibilityOf(const CoarseView& view, const Eigen::Vector3d& p_in_world,
                        double tolerance) {
  const Eigen::Vector3d p_in_cam = view.cam_from_world * p_in_world;
  const auto pixel = view.camera.PixelFromCam(p_in_cam);
  if (!pixel || !view.camera.Contains(*pixel)) return Visibility::kOutside;
  const int x = static_cast<int>(pixel->x()), y = static_cast<int>(pixel->y());
  double nearest = 1e300;  // relative difference of inverse depths
  bool before = false;
  int depths = 0;
  for (int j = std::max(0, y - 1); j <= std::min(view.depth.height() - 1, y + 1); ++j) {
    for (int i = std::max(0, x - 1); i <= std::min(view.depth.width() - 1, x + 1); ++i) {
      const float z = view.depth(i, j);
      if (DepthImage::IsHole(z)) continue;
      ++depths;
      const double difference = p_in_cam.z() / z - 1;
      if (std::abs(difference) >= nearest) continue;
      nearest = std::abs(difference);
      before = difference > 0;
    }
  }
  if (depths == 0 || (DepthImage::IsHole(view.depth(x, y)) && nearest >= tolerance)) {
    return Visibility::kNothing;
  }
  if (nearest < tolerance) return Visibility::kSeen;
  return before ? Visibility::kHidden : Visibility::kBeyond;
}

}  // namespace dtr::advise
