#include "calib/validation/board_residuals.h"

#include <cmath>
#include <limits>

#include "calib/lens_map.h"

namespace dtr::calib {

std::vector<ResidualArrow> ArrowsOf(const Board& board, const Rig& rig, const RigView& view) {
  const RigCamera& camera = rig.cameras[view.camera];
  const LensMap lens(camera.camera);
  const Pose cam_from_board = camera.cam_from_rig * rig.rig_from_board[view.frame];
  std::vector<ResidualArrow> arrows;
  for (const BoardCorner& corner : view.seen.corners) {
    if (Holds(view.outliers, corner.id)) continue;
    const auto pixel = lens.PixelFromCam(cam_from_board * board.Corner(corner.id));
    if (pixel) arrows.push_back({corner.pixel, *pixel - corner.pixel});
  }
  return arrows;
}

void AddResiduals(const Board& board, const Rig& rig, BoardResiduals& out) {
  out.by_camera.resize(rig.cameras.size());
  out.arrows.resize(rig.cameras.size());
  for (const RigView& view : rig.views) {
    const auto arrows = ArrowsOf(board, rig, view);
    for (const ResidualArrow& arrow : arrows) {
      out.by_camera[view.camera].push_back(arrow.residual_px);
      out.arrows[view.camera].push_back(arrow);
      out.squares += arrow.residual_px.squaredNorm();
    }
    out.corners += static_cast<int>(arrows.size());
    out.outliers += static_cast<int>(view.seen.corners.size() - arrows.size());
  }
}

double SigmaOf(const BoardResiduals& residuals, size_t frames) {
  const double freedom = 2.0 * residuals.corners - 6.0 * static_cast<double>(frames);
  return freedom > 0 ? std::sqrt(residuals.squares / freedom)
                     : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace dtr::calib
