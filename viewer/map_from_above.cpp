#include "viewer/map_from_above.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "dtr/report/encode.h"
#include "dtr/report/false_color.h"
#include "viewer/controller.h"
#include "viewer/navigation.h"
#include "viewer/world_up.h"

namespace dtr::viewer {
namespace {

constexpr double kMarginShare = 0.05;  // of the longer side
constexpr int kMapWidthPx = 760, kMaxMapHeightPx = 1200;
constexpr double kWedgeShare = 0.05;  // of the map's width: length of a camera
constexpr int kSamplesAcross = 480;   // of a depth map

double Longer(const Ground& ground) { return (ground.max - ground.min).maxCoeff(); }

}  // namespace

Ground GroundOf(const DtrSet& set) {
  const Surroundings around = SurroundingsOf(set);
  std::vector<Pose> poses;
  Eigen::Vector3d forward = Eigen::Vector3d::Zero();
  for (const View* view : around.views) {
    poses.push_back(view->cam_from_world);
    forward += view->cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  }
  Ground ground;
  const Eigen::Vector3d up = WorldUp(set);
  // Seen from above, looking down: LookAlong puts what the cameras look at at the top; of images
  // from the air what is at the top of most of them.
  const bool from_the_air = forward.normalized().dot(-up) >= kFromTheAir;
  const Pose from_above =
      LookAlong(set.scene_center, -up, from_the_air ? UpInImages(poses) : forward);
  ground.right = from_above.rotation.conjugate() * Eigen::Vector3d::UnitX();
  ground.down = from_above.rotation.conjugate() * Eigen::Vector3d::UnitY();
  ground.min = ground.max = ground.Place(set.scene_center);
  const auto hold = [&](const Eigen::Vector3d& p) {
    ground.min = ground.min.cwiseMin(ground.Place(p));
    ground.max = ground.max.cwiseMax(ground.Place(p));
  };
  for (const View* view : around.views) hold(view->CenterInWorld());
  for (int corner = 0; corner < 8 && !set.bounds.empty(); ++corner) {
    const Eigen::Vector3d &low = set.bounds.min, &high = set.bounds.max;
    hold({(corner & 1 ? high : low).x(), (corner & 2 ? high : low).y(),
          (corner & 4 ? high : low).z()});
  }
  double margin = kMarginShare * Longer(ground);
  if (!(margin > 0)) margin = 1;
  ground.min.array() -= margin;
  ground.max.array() += margin;
  return ground;
}

CoverageFromAbove::CoverageFromAbove(const Ground& ground, int side_px) : ground_(ground) {
  const Eigen::Vector2d size = ground.max - ground.min;
  const double cell = size.maxCoeff() / side_px;
  counts_ = Grid<std::uint16_t>(std::max(1, static_cast<int>(std::lround(size.x() / cell))),
                                std::max(1, static_cast<int>(std::lround(size.y() / cell))));
}

void CoverageFromAbove::Add(const View& view) {
  if (view.depth.empty()) return;
  Grid<std::uint8_t> seen(counts_.width(), counts_.height());
  const PinholeCamera camera = view.DepthCamera();
  const Pose world_from_cam = view.cam_from_world.Inverse();
  const int step = std::max(1, view.depth.width() / kSamplesAcross);
  const Eigen::Vector2d size = ground_.max - ground_.min;
  for (int y = step / 2; y < view.depth.height(); y += step) {
    for (int x = step / 2; x < view.depth.width(); x += step) {
      const float z = view.depth(x, y);
      if (DepthImage::IsHole(z)) continue;
      const Eigen::Vector3d p =
          world_from_cam * camera.CamFromPixel({x + 0.5, y + 0.5}, z, DepthKind::kPlaneZ);
      const Eigen::Vector2d share = (ground_.Place(p) - ground_.min).cwiseQuotient(size);
      // Before the cast: a point may lie beyond what an int holds.
      if (!(share.minCoeff() >= 0 && share.maxCoeff() < 1)) continue;
      seen(static_cast<int>(share.x() * counts_.width()),
           static_cast<int>(share.y() * counts_.height())) = 1;
    }
  }
  for (size_t p = 0; p < seen.data().size(); ++p) {
    counts_.data()[p] = static_cast<std::uint16_t>(counts_.data()[p] + seen.data()[p]);
  }
}

ImageRgb8 CoverageFromAbove::Picture(int views) const {
  ImageRgb8 image(counts_.width(), counts_.height(), 3);
  for (size_t p = 0; p < counts_.data().size(); ++p) {
    const int count = counts_.data()[p];
    const auto colour = count == 0
                            ? report::kHoleColor
                            : report::PaletteColor(report::Palette::kColor,
                                                   static_cast<double>(count) / std::max(views, 1));
    std::copy(colour.begin(), colour.end(),
              image.data().begin() + static_cast<std::ptrdiff_t>(3 * p));
  }
  return image;
}

std::string CameraMapSvg(const DtrSet& set, const Ground& ground,
                         const std::function<std::string(const View&)>& colour_of) {
  const Eigen::Vector2d size = ground.max - ground.min;
  const double scale = std::min(kMapWidthPx / size.x(), kMaxMapHeightPx / size.y());
  const double wedge = kWedgeShare * kMapWidthPx;
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "viewBox=\"0 0 {0:.0f} {1:.0f}\" font-family=\"sans-serif\" font-size=\"11\">\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
      size.x() * scale, size.y() * scale);
  const auto place = [&](const Eigen::Vector3d& p) -> Eigen::Vector2d {
    return (ground.Place(p) - ground.min) * scale;
  };
  const Eigen::Vector2d middle = place(set.scene_center);
  svg += fmt::format(
      "<path d=\"M{0:.1f} {1:.1f}m-6 0h12m-6 -6v12\" stroke=\"#888\"/>"
      "<text x=\"{2:.1f}\" y=\"{1:.1f}\" fill=\"#888\">scene centre</text>\n",
      middle.x(), middle.y(), middle.x() + 9);
  for (const View* view : SurroundingsOf(set).views) {
    const Eigen::Vector2d at = place(view->CenterInWorld());
    const Eigen::Quaterniond world_from_cam = view->cam_from_world.rotation.conjugate();
    const auto side = [&](double pixel_x) -> Eigen::Vector2d {
      const Eigen::Vector3d ray =
          world_from_cam * view->camera.RayFromPixel({pixel_x, view->camera.cy_px()});
      const Eigen::Vector2d on_map = ground.Place(ray);
      const double length = on_map.norm();
      return length > 0 ? Eigen::Vector2d(at + wedge / length * on_map) : at;
    };
    const Eigen::Vector2d left = side(0), right = side(view->camera.width_px());
    const std::string colour = report::EscapeHtml(colour_of(*view));
    svg += fmt::format(
        "<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}L{:.1f} {:.1f}Z\" fill=\"{}\" fill-opacity=\"0.25\" "
        "stroke=\"{}\"/><text x=\"{:.1f}\" y=\"{:.1f}\" fill=\"#222\">{}</text>\n",
        at.x(), at.y(), left.x(), left.y(), right.x(), right.y(), colour, colour, at.x() + 3,
        at.y() + 12, report::EscapeHtml(view->name));
  }
  return svg + "</svg>\n";
}

}  // namespace dtr::viewer
