#include "calib/sfm/mapping/ideal_graph.h"

#include <algorithm>

#include "calib/lens_map.h"
#include "calib/sfm/mapping/adjust_map.h"

namespace dtr::sfm {
namespace {

constexpr double kLeastCosine = 0.17;  // 80 degrees off the axis: beyond, pixels are far apart

calib::LensCamera PinholeOf(const calib::LensCamera& lens) {
  const PinholeCamera k = lens.Pinhole();
  return {calib::CameraModel::kPinhole,
          lens.width_px,
          lens.height_px,
          {k.fx_px(), k.fy_px(), k.cx_px(), k.cy_px()}};
}

// Pixels of the pinhole camera, and which of the features have one.
std::vector<char> Straighten(const calib::LensCamera& lens, const calib::LensCamera& pinhole,
                             std::vector<Eigen::Vector2d>& pixels) {
  const calib::LensMap map(lens);
  std::vector<char> visible;
  for (Eigen::Vector2d& pixel : pixels) {
    const auto ray = map.RayFromPixel(pixel);
    visible.push_back(ray && ray->z() > kLeastCosine ? 1 : 0);
    if (visible.back() != 0) pixel = *pinhole.PixelFromCam(*ray);
  }
  return visible;
}

}  // namespace

ViewGraph IdealGraph(const ViewGraph& graph) {
  ViewGraph ideal = graph;
  for (calib::LensCamera& camera : ideal.cameras) {
    if (!CanAdjust(camera)) camera = PinholeOf(camera);
  }
  std::vector<std::vector<char>> visible(graph.images.size());
  for (size_t i = 0; i < graph.images.size(); ++i) {
    const auto camera = static_cast<size_t>(graph.images[i].camera);
    if (CanAdjust(graph.cameras[camera])) continue;
    visible[i] = Straighten(graph.cameras[camera], ideal.cameras[camera], ideal.images[i].pixels);
  }
  const auto is_seen = [&](int image, std::uint32_t feature) {
    const auto& of_image = visible[static_cast<size_t>(image)];
    return of_image.empty() || of_image[feature] != 0;
  };
  for (PairGeometry& pair : ideal.pairs) {
    std::erase_if(pair.matches, [&](const auto& match) {
      return !is_seen(pair.image_a, match.first) || !is_seen(pair.image_b, match.second);
    });
  }
  return ideal;
}

void PutBackCameras(const ViewGraph& graph, calib::SfmModel* model) {
  for (auto& [id, camera] : model->cameras) camera = graph.cameras[id - 1];
  for (calib::SfmImage& image : model->images) {
    const GraphImage& own = graph.images[image.id - 1];
    for (size_t f = 0; f < own.pixels.size(); ++f) image.features[f].pixel = own.pixels[f];
  }
}

}  // namespace dtr::sfm
