#include "pipeline/metres/detail/placed_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/triangulate.h"
#include "dtr/base/error.h"
#include "dtr/io/set_io.h"

namespace dtr::pipeline {
namespace {

constexpr double kClickSigmaPx = 1;
constexpr double kUnknownDisparitySigmaPx = 1;
constexpr double kMaxMissPx = 5;

const View& ViewOf(const DtrSet& set, const ScaleClick& click) {
  const auto& views = set.frames.front().views;
  const auto found = std::find_if(views.begin(), views.end(),
                                  [&](const View& view) { return view.id == click.view_id; });
  if (found == views.end()) throw Error("view " + click.view_id + ": expected a view of the set");
  return *found;
}

void RequireInside(const View& view, const ScalePoint& point, const Eigen::Vector2d& pixel) {
  if (view.camera.Contains(pixel)) return;
  throw UsageError(fmt::format("{}: expected a pixel of the {} x {} of view {}", point.text,
                               view.camera.width_px(), view.camera.height_px(), view.name));
}

PlacedPoint FromDepth(const std::filesystem::path& folder, View view, const ScalePoint& point,
                      const Eigen::Vector2d& pixel) {
  const auto reject = [&](const char* why) {
    return Error(fmt::format(
        "{}: expected depth there, found {}; click a pixel beside it, or the same point in two "
        "views: {}+VIEW:X:Y",
        point.text, why, point.text));
  };
  if (!view.depth_file) throw reject("a view without a depth map");
  io::LoadOptions load;
  load.images = false;
  load.sigma = true;
  io::LoadPixels(folder, view, load);
  const int x = static_cast<int>(pixel.x()) / view.depth_scale;
  const int y = static_cast<int>(pixel.y()) / view.depth_scale;
  const float z = view.depth(x, y);
  if (DepthImage::IsHole(z)) throw reject("a hole");
  double inverse_sigma = 0;
  if (view.inverse_depth_sigma && (*view.inverse_depth_sigma)(x, y) > 0) {
    inverse_sigma = (*view.inverse_depth_sigma)(x, y);
  } else if (view.reference_baseline > 0) {
    inverse_sigma = kUnknownDisparitySigmaPx / (view.camera.fx_px() * view.reference_baseline);
  } else {
    throw reject("one whose uncertainty is not known");
  }
  const Eigen::Vector3d p_in_cam = view.camera.CamFromPixel(pixel, z, DepthKind::kPlaneZ);
  Eigen::Matrix3d in_cam = Eigen::Matrix3d::Zero();
  in_cam(0, 0) = std::pow(kClickSigmaPx * z / view.camera.fx_px(), 2);
  in_cam(1, 1) = std::pow(kClickSigmaPx * z / view.camera.fy_px(), 2);
  const Eigen::Vector3d along = p_in_cam / z;  // the way a change of z goes
  in_cam += std::pow(inverse_sigma * z * z, 2) * along * along.transpose();
  const Eigen::Matrix3d world_from_cam =
      view.cam_from_world.rotation.conjugate().toRotationMatrix();
  return {view.cam_from_world.Inverse() * p_in_cam,
          world_from_cam * in_cam * world_from_cam.transpose()};
}

PlacedPoint FromRays(const DtrSet& set, const ScalePoint& point) {
  std::vector<calib::Observation> observations;
  for (const ScaleClick& click : point.clicks) {
    const View& view = ViewOf(set, click);
    if (!click.pixel) {
      throw UsageError(
          fmt::format("{}: expected a pixel of every view joined with +, found none of {}",
                      point.text, click.view_id));
    }
    RequireInside(view, point, *click.pixel);
    observations.push_back(calib::MakeObservation(view.camera, view.cam_from_world, *click.pixel));
  }
  const calib::Triangulation found = calib::Triangulate(observations, -1);
  if (found.status != calib::TriangulationStatus::kConverged) {
    throw Error(fmt::format(
        "{}: expected rays that meet before the cameras, found {}; click the same point in views "
        "from different positions",
        point.text,
        found.status == calib::TriangulationStatus::kBehind ? "none that do" : "parallel ones"));
  }
  for (size_t i = 0; i < observations.size(); ++i) {
    Eigen::Vector2d miss;
    Eigen::Matrix<double, 2, 3> unused;
    if (PixelResidual(observations[i], found.p_in_world, &miss, &unused) &&
        miss.norm() <= kMaxMissPx) {
      continue;
    }
    throw Error(fmt::format(
        "{}: expected the same point in every view, found view {} {:.1f} px off the others; click "
        "again",
        point.text, point.clicks[i].view_id, miss.norm()));
  }
  return {found.p_in_world, kClickSigmaPx * kClickSigmaPx * found.covariance};
}

}  // namespace

PlacedPoint Place(const std::filesystem::path& folder, const DtrSet& set, const ScalePoint& point) {
  if (point.clicks.size() > 1) return FromRays(set, point);
  const ScaleClick& click = point.clicks.front();
  const View& view = ViewOf(set, click);
  if (!click.pixel) return {view.CenterInWorld(), Eigen::Matrix3d::Zero()};
  RequireInside(view, point, *click.pixel);
  return FromDepth(folder, view, point, *click.pixel);
}

}  // namespace dtr::pipeline
