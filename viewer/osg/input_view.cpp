#include "viewer/osg/input_view.h"

#include <numbers>

#include "dtr/cpu/renderer.h"

namespace osgDTR {

std::vector<osg::Vec3f> InputView::get3D() const {
  const dtr::PinholeCamera camera = view_->DepthCamera();
  const dtr::Pose world_from_cam = view_->cam_from_world.Inverse();
  const dtr::DepthImage& depth = view_->depth;
  std::vector<osg::Vec3f> points;
  points.reserve(depth.grid().data().size());
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      const float z = depth(x, y);
      if (dtr::DepthImage::IsHole(z)) {
        points.emplace_back(0.0F, 0.0F, 0.0F);
        continue;
      }
      const Eigen::Vector3f p =
          (world_from_cam * camera.CamFromPixel({x + 0.5, y + 0.5}, z, dtr::DepthKind::kPlaneZ))
              .cast<float>();
      points.emplace_back(p.x(), p.y(), p.z());
    }
  }
  return points;
}

void InputView::projectView(const dtr::PinholeCamera& novel, const dtr::Pose& novel_from_world,
                            dtr::RenderOptions options) {
  dtr::RenderScene alone;
  alone.views = {view_};
  alone.per_pixel = false;
  options.method = dtr::RenderMethod::kTwoPass;
  options.max_angle_rad = std::numbers::pi;
  options.fill_holes = options.smooth_edges = false;
  dtr::RenderResult result = dtr::cpu::Render(alone, novel, novel_from_world, options);
  projected_.holes = std::move(result.coverage);
  for (std::uint8_t& seen : projected_.holes.data()) seen = seen == 0 ? 255 : 0;
  projected_.projectedImage = std::move(result.image);
  projected_.projectedDepth = std::move(result.depth);
}

}  // namespace osgDTR
