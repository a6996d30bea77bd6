#include "python/core/unproject.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dtr/base/error.h"

namespace dtr::python {
namespace {

/// Pixel of the image at the centre of pixel (x, y) of a map 1/scale as large.
struct ImagePixel {
  int x, y;
};
ImagePixel AtCentre(int x, int y, int scale) {
  return {x * scale + scale / 2, y * scale + scale / 2};
}

template <typename Vector, typename List>
void Append(const Vector& values, List& list) {
  list.insert(list.end(), values.begin(), values.end());
}

}  // namespace

Unprojected Unproject(OpenSet& set, ViewPlace at, bool completed) {
  const View& view = set.view(at);
  const Floats measured = set.FloatsOf(at, Plane::kDepth);
  if (!measured) {
    throw Error(view.name +
                ": expected a view with depth, found none; held-out views have no depth");
  }
  const Bytes image = set.BytesOf(at, Plane::kImage);
  if (!image) throw Error(view.name + ": expected a view with an image, found none");
  const Bytes mask = set.BytesOf(at, Plane::kMask);
  const Floats sigma = set.FloatsOf(at, Plane::kSigma);
  const Floats more = completed ? set.FloatsOf(at, Plane::kCompletedDepth) : nullptr;
  const PinholeCamera camera = view.DepthCamera();
  const Pose world_from_cam = view.cam_from_world.Inverse();

  Unprojected all;
  for (int y = 0; y < measured->height(); ++y) {
    for (int x = 0; x < measured->width(); ++x) {
      float z = (*measured)(x, y);
      const bool is_measured = !DepthImage::IsHole(z);
      if (!is_measured && more) z = (*more)(x, y);
      const ImagePixel pixel = AtCentre(x, y, view.depth_scale);
      if (DepthImage::IsHole(z) || (mask && (*mask)(pixel.x, pixel.y) == 0)) continue;
      const Eigen::Vector3d in_cam = camera.CamFromPixel({x + 0.5, y + 0.5}, z, DepthKind::kPlaneZ);
      const Eigen::Vector3d ray = in_cam / in_cam.z();
      // Of z it is z^2 times that of 1/z; the ray is longer than z by its length.
      const double deviation = is_measured && sigma ? double{z} * z * (*sigma)(x, y) * ray.norm()
                                                    : std::numeric_limits<double>::quiet_NaN();
      Append(Eigen::Vector3d(world_from_cam * in_cam), all.points);
      Append(Eigen::Vector3d(world_from_cam.rotation * ray.normalized()), all.directions);
      const std::uint8_t* const rgb = &(*image)(pixel.x, pixel.y);
      all.rgb.insert(all.rgb.end(), rgb, rgb + 3);
      all.sigma.push_back(deviation);
      all.pixels.insert(all.pixels.end(), {x, y});
      all.completed.push_back(is_measured ? 0 : 1);
    }
  }
  return all;
}

}  // namespace dtr::python
