#include "viewer/osg/loaded_scene.h"

#include <osg/Notify>

#include <algorithm>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/set_io.h"

namespace osgDTR {
namespace {

// Cells of samples reach half a sample beyond their centres (SPEC 2.6): room for R up to 4.
constexpr double kCellPixels = 2;

osg::BoundingBox BoundsOf(const dtr::View& view) {
  osg::BoundingBox bounds;
  const dtr::PinholeCamera camera = view.DepthCamera();
  const dtr::Pose world_from_cam = view.cam_from_world.Inverse();
  const double cell = kCellPixels / std::min(camera.fx_px(), camera.fy_px());
  for (int y = 0; y < view.depth.height(); ++y) {
    for (int x = 0; x < view.depth.width(); ++x) {
      const float z = view.depth(x, y);
      if (dtr::DepthImage::IsHole(z)) continue;
      const Eigen::Vector3d p =
          world_from_cam * (static_cast<double>(z) * camera.RayFromPixel({x + 0.5, y + 0.5}));
      const double reach = cell * z;
      bounds.expandBy(osg::Vec3d(p.x() - reach, p.y() - reach, p.z() - reach));
      bounds.expandBy(osg::Vec3d(p.x() + reach, p.y() + reach, p.z() + reach));
    }
  }
  return bounds;
}

}  // namespace

std::shared_ptr<const LoadedSet> MakeSet(dtr::DtrSet set) {
  auto loaded = std::make_shared<LoadedSet>();
  loaded->clock = dtr::FrameClock(set);
  std::vector<const dtr::View*> views;
  for (dtr::DtrSet& still : dtr::SplitFrames(std::move(set))) {
    LoadedScene& instant = loaded->instants.emplace_back();
    instant.set = std::move(still);  // its views stay where they are
    instant.scene = dtr::MakeRenderScene(instant.set);
    views.insert(views.end(), instant.scene.views.begin(), instant.scene.views.end());
  }
  if (loaded->instants.empty()) throw dtr::Error("set: expected at least one frame, found none");
  std::vector<osg::BoundingBox> bounds(views.size());
  dtr::ParallelFor(0, static_cast<int>(bounds.size()), 0, [&](int i) {
    const auto k = static_cast<size_t>(i);
    bounds[k] = BoundsOf(*views[k]);
  });
  for (const osg::BoundingBox& one : bounds) loaded->bounds.expandBy(one);
  return loaded;
}

std::shared_ptr<const LoadedSet> LoadSet(const std::string& set_folder) {
  dtr::io::LoadOptions options;
  options.warn = [](const std::string& line) { OSG_WARN << line << std::endl; };
  return MakeSet(dtr::io::LoadSet(set_folder, options));
}

}  // namespace osgDTR
