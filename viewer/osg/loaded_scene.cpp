#include "viewer/osg/loaded_scene.h"

#include <osg/Notify>

#include <algorithm>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/pruned.h"
#include "dtr/io/set_io.h"
#include "dtr/render/stored_options.h"

namespace osgDTR {
namespace {

// Cells of samples reach half a sample beyond their centres (SPEC 2.6): room for R up to 4.
constexpr double kCellPixels = 2;

// OpenSceneGraph sets the far plane by the bound, and the near plane 1/2000 as far away: a pixel
// that stereo put a thousand times too far would clip the foreground of everything. Pixels without
// company at so many times the depth of all but so few are left out of the bound.
constexpr double kOutlierShare = 0.001, kOutlierFactor = 4;
constexpr int kCompany = 4;  // of the eight around: a surface, however small

/// Depth beyond which a view's pixels do not count for the bound.
float FarthestDepth(const dtr::View& view) {
  std::vector<float> depths;
  for (const float z : view.depth.grid().data()) {
    if (!dtr::DepthImage::IsHole(z)) depths.push_back(z);
  }
  if (depths.empty()) return 0;
  return static_cast<float>(kOutlierFactor) * dtr::QuantileOf(depths, 1 - kOutlierShare);
}

bool HasCompany(const dtr::DepthImage& depth, int x, int y, float farthest) {
  int company = 0;
  for (int v = std::max(0, y - 1); v <= std::min(depth.height() - 1, y + 1); ++v) {
    for (int u = std::max(0, x - 1); u <= std::min(depth.width() - 1, x + 1); ++u) {
      company += (u != x || v != y) && depth(u, v) > farthest;
    }
  }
  return company >= kCompany;
}

osg::BoundingBox BoundsOf(const dtr::View& view) {
  osg::BoundingBox bounds;
  const float farthest = FarthestDepth(view);
  const dtr::PinholeCamera camera = view.DepthCamera();
  const dtr::Pose world_from_cam = view.cam_from_world.Inverse();
  const double cell = kCellPixels / std::min(camera.fx_px(), camera.fy_px());
  for (int y = 0; y < view.depth.height(); ++y) {
    for (int x = 0; x < view.depth.width(); ++x) {
      const float z = view.depth(x, y);
      if (dtr::DepthImage::IsHole(z)) continue;
      if (z > farthest && !HasCompany(view.depth, x, y, farthest)) continue;
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
    LoadedScene& time_step = loaded->time_steps.emplace_back();
    time_step.set = std::move(still);  // its views stay where they are
    time_step.scene = dtr::MakeRenderScene(time_step.set);
    views.insert(views.end(), time_step.scene.views.begin(), time_step.scene.views.end());
  }
  if (loaded->time_steps.empty()) throw dtr::Error("set: expected at least one frame, found none");
  std::vector<osg::BoundingBox> bounds(views.size());
  dtr::ParallelFor(0, static_cast<int>(bounds.size()), [&](int i) {
    const auto k = static_cast<size_t>(i);
    bounds[k] = BoundsOf(*views[k]);
  });
  for (const osg::BoundingBox& one : bounds) loaded->bounds.expandBy(one);
  const auto stored = dtr::io::RenderOptionsOf(loaded->time_steps.front().set);
  loaded->defaults = dtr::WithStoredOptions(dtr::WholeFrames(), stored.json, stored.where);
  return loaded;
}

std::shared_ptr<const LoadedSet> LoadSet(const std::string& set_folder) {
  dtr::io::LoadOptions options;
  options.completed = true;
  options.warn = [](const std::string& line) { OSG_WARN << line << std::endl; };
  return MakeSet(dtr::io::LoadSet(set_folder, options));
}

}  // namespace osgDTR
