#include "calib/solve/rig_system.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "calib/solve/board_solve.h"
#include "calib/solve/reprojection.h"
#include "dtr/base/error.h"

namespace dtr::calib {
namespace {

// The camera in coordinates whose derivatives are by the parameters themselves.
struct NaturalCamera {
  LensCoordinates lens;
  PoseCoordinates place;
};

NaturalCamera NaturalOf(const RigCamera& camera) {
  NaturalCamera natural;
  natural.lens = CoordinatesAround(camera.model, camera.camera, 1);
  natural.lens.scale.fill(1);
  natural.place.rotation = camera.cam_from_rig.rotation.toRotationMatrix();
  natural.place.translation = camera.cam_from_rig.translation;
  natural.place.scale = 1;
  return natural;
}

struct Evaluated {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor> by_lens;
  Eigen::Matrix<double, 2, 6, Eigen::RowMajor> by_place, by_motion;
};

Evaluated Evaluate(const NaturalCamera& camera, const PoseCoordinates& rig_from_board,
                   const Eigen::Vector3d& corner, const Eigen::Vector2d& observed_px) {
  static constexpr std::array<double, kMaxLensParameters> kZero{};
  Evaluated out;
  out.by_lens.resize(2, FreeParameterCount(camera.lens.model));
  const double* blocks[] = {kZero.data(), kZero.data(), kZero.data()};
  double* jacobians[] = {out.by_lens.data(), out.by_place.data(), out.by_motion.data()};
  const auto cost = RigCost(camera.lens, camera.place, rig_from_board, corner, observed_px);
  if (!cost->Evaluate(blocks, out.residual.data(), jacobians)) {
    throw Error("calibration: a corner left the field of view");
  }
  return out;
}

void PutShared(const Evaluated& evaluated, const RigLayout& layout, size_t camera,
               Eigen::Ref<Eigen::MatrixXd> by_shared) {
  by_shared.setZero();
  if (layout.LensAt(camera) >= 0) {
    by_shared.middleCols(layout.LensAt(camera), evaluated.by_lens.cols()) = evaluated.by_lens;
  }
  if (layout.PlaceAt(camera) >= 0) {
    by_shared.middleCols(layout.PlaceAt(camera), 6) = evaluated.by_place;
  }
}

}  // namespace

std::vector<FrameRows> RowsOf(const Board& board, const Rig& rig, const RigLayout& layout) {
  std::vector<NaturalCamera> cameras;
  for (const RigCamera& camera : rig.cameras) cameras.push_back(NaturalOf(camera));
  const Eigen::Vector3d pivot = MiddleOf(board);
  std::vector<std::vector<RowOrigin>> by_frame(rig.rig_from_board.size());
  for (size_t v = 0; v < rig.views.size(); ++v) {
    const RigView& view = rig.views[v];
    for (size_t j = 0; j < view.seen.corners.size(); ++j) {
      if (!Holds(view.outliers, view.seen.corners[j].id)) by_frame[view.frame].push_back({v, j});
    }
  }
  std::vector<FrameRows> all;
  for (size_t f = 0; f < by_frame.size(); ++f) {
    if (by_frame[f].empty()) continue;
    const PoseCoordinates pose = CoordinatesAround(rig.rig_from_board[f], pivot);
    FrameRows rows;
    rows.frame = f;
    rows.origins = std::move(by_frame[f]);
    rows.middle_in_rig = pose.translation;
    rows.distance = pose.scale;
    const auto count = 2 * static_cast<long>(rows.origins.size());
    rows.residuals.resize(count);
    rows.by_shared.resize(count, layout.size());
    rows.by_motion.resize(count, 6);
    for (size_t i = 0; i < rows.origins.size(); ++i) {
      const RigView& view = rig.views[rows.origins[i].view];
      const BoardCorner& corner = view.seen.corners[rows.origins[i].corner];
      const Evaluated evaluated =
          Evaluate(cameras[view.camera], pose, board.Corner(corner.id) - pivot, corner.pixel);
      const auto at = 2 * static_cast<long>(i);
      rows.residuals.segment<2>(at) = evaluated.residual;
      rows.by_motion.middleRows<2>(at) = evaluated.by_motion;
      PutShared(evaluated, layout, view.camera, rows.by_shared.middleRows(at, 2));
    }
    all.push_back(std::move(rows));
  }
  return all;
}

ArrowInformation InformationOf(const std::vector<FrameRows>& rows, const RigLayout& layout) {
  ArrowInformation information(layout.size());
  for (const FrameRows& frame : rows) information.AddPose(frame.by_shared, frame.by_motion);
  if (information.Invert()) return information;
  std::string which = "a pose of the board";
  if (information.weakest().size() > 0) {
    long index = 0;
    information.weakest().cwiseAbs().maxCoeff(&index);
    which = layout.NameOf(static_cast<int>(index));
  }
  throw Error(
      fmt::format("calibration: the corners do not determine {}; take more views, tilted "
                  "and into the corners of the image, or choose a model with fewer "
                  "coefficients",
                  which));
}

PixelDerivatives DerivativesAt(const Rig& rig, const RigLayout& layout, size_t camera,
                               const Eigen::Vector3d& p_in_rig) {
  PoseCoordinates point;
  point.translation = p_in_rig;
  const Evaluated evaluated = Evaluate(NaturalOf(rig.cameras[camera]), point,
                                       Eigen::Vector3d::Zero(), Eigen::Vector2d::Zero());
  PixelDerivatives out;
  out.by_shared.resize(2, layout.size());
  PutShared(evaluated, layout, camera, out.by_shared);
  out.by_point = evaluated.by_motion.rightCols<3>();
  return out;
}

}  // namespace dtr::calib
