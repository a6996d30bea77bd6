#include "viewer/world_up.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <vector>

#include "viewer/navigation.h"

namespace dtr::viewer {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
// A turn that is less well known says little of what is up.
constexpr double kMaxTurnSigmaDeg = 5;  // as for taking axes from GPS: calib/scale.h

// Mean square sine between x axes and the level, by the axes that agree: beyond that cameras are
// rolled at will. The axes' own spread in the level weighs against the other evidence times this.
const double kMaxRoll = std::pow(std::sin(12 * kDegree), 2);
constexpr double kWeightOfPrior = 0.01;
// Least absolute deviations by reweighted squares: sines below this count alike.
constexpr double kMinSine = 0.02;
constexpr int kReweightings = 20;
// Cosine to the vertical: 75 degrees and more from it, it tells no side.
constexpr double kTellsSide = 0.26;

Eigen::Vector3d Sum(std::span<const Pose> cams_from_world, const Eigen::Vector3d& axis_in_cam) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Pose& pose : cams_from_world) sum += AxisInWorld(pose, axis_in_cam);
  return sum;
}

/// The plane that cameras stand in: through `middle`, `normal` of either sign.
struct StandingPlane {
  Eigen::Vector3d middle, normal;
  double spread = 0;  ///< standard deviation along its longer axis
};

/// None where they stand in one point, on a line, or off any plane.
std::optional<StandingPlane> PlaneOf(std::span<const Pose> cams_from_world,
                                     const Eigen::Vector3d& scene_center) {
  // Off the plane in shares of its shorter axis, that in shares of its longer one, and this in
  // shares of the way to the scene.
  constexpr double kMaxOffPlane = 0.2, kMinAcross = 0.15, kMinSpread = 1e-3;
  const auto count = static_cast<double>(cams_from_world.size());
  if (count < 4) return std::nullopt;
  StandingPlane plane;
  plane.middle.setZero();
  for (const Pose& pose : cams_from_world) plane.middle += pose.TargetOriginInSource() / count;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Pose& pose : cams_from_world) {
    const Eigen::Vector3d off = pose.TargetOriginInSource() - plane.middle;
    spread += off * off.transpose() / count;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);  // ascending
  const Eigen::Vector3d size = axes.eigenvalues().cwiseMax(0).cwiseSqrt();
  if (!(size[0] <= kMaxOffPlane * size[1]) || !(size[1] >= kMinAcross * size[2])) {
    return std::nullopt;
  }
  plane.normal = axes.eigenvectors().col(0);
  plane.spread = size[2];
  if (!(plane.spread > kMinSpread * (scene_center - plane.middle).norm())) return std::nullopt;
  return plane;
}

/// True where cameras look straight at the plane that they stand in, and see little more than where
/// they stand: images from the air. A rig before a wall stands in a plane, too, but sees more.
bool LookAtTheirPlane(const StandingPlane& plane, const Eigen::Vector3d& mean_forward,
                      const Eigen::Vector3d& scene_center) {
  constexpr double kMinSpreadOverDistance = 0.4;
  const double distance = std::abs(plane.normal.dot(scene_center - plane.middle));
  return std::abs(plane.normal.dot(mean_forward)) >= kFromTheAir &&
         plane.spread >= kMinSpreadOverDistance * distance;
}

/// All that is known of up but the level of x axes.
Eigen::Vector3d PriorUp(std::span<const Pose> cams_from_world,
                        const Eigen::Vector3d& scene_center) {
  // Of a mean of unit vectors: below, they have no common direction; above, they nearly agree.
  constexpr double kNoDirection = 0.2, kOneDirection = 0.8;
  // A plane is the ground's where its normal is within 53 degrees of the cameras' up.
  constexpr double kLevelPlane = 0.6;
  const auto count = static_cast<double>(cams_from_world.size());
  const Eigen::Vector3d up = Sum(cams_from_world, -Eigen::Vector3d::UnitY()) / count;
  const Eigen::Vector3d forward = Sum(cams_from_world, Eigen::Vector3d::UnitZ()) / count;
  if (const auto plane = PlaneOf(cams_from_world, scene_center)) {
    const auto along = [&](const Eigen::Vector3d& direction) -> Eigen::Vector3d {
      return plane->normal.dot(direction) >= 0 ? plane->normal : Eigen::Vector3d(-plane->normal);
    };
    if (LookAtTheirPlane(*plane, forward, scene_center)) return along(-forward);
    if (std::abs(plane->normal.dot(up)) >= kLevelPlane * up.norm() && up.norm() >= kNoDirection) {
      return along(up);
    }
  }
  if (up.norm() >= kNoDirection) return up.normalized();
  if (forward.norm() >= kOneDirection) return -forward.normalized();
  return AxisInWorld(cams_from_world.front(), -Eigen::Vector3d::UnitY());
}

}  // namespace

std::optional<Eigen::Vector3d> KnownUp(const DtrSet& set) {
  const auto provenance = nlohmann::json::parse(set.provenance_json, nullptr, false);
  if (!provenance.is_object() || !provenance.contains("scale")) return std::nullopt;
  const auto& scales = provenance["scale"];
  if (!scales.is_array()) return std::nullopt;
  for (const auto& scale : scales) {
    if (!scale.is_object() || scale.value("axes", nlohmann::json()) != "east, north, up") continue;
    const auto turn = scale.value("turn_sigma_deg", nlohmann::json());
    if (turn.is_number() && turn.get<double>() <= kMaxTurnSigmaDeg) return Eigen::Vector3d::UnitZ();
  }
  return std::nullopt;
}

Eigen::Vector3d UpOfCameras(std::span<const Pose> cams_from_world,
                            const Eigen::Vector3d& scene_center) {
  if (cams_from_world.empty()) return -Eigen::Vector3d::UnitY();
  const Eigen::Vector3d prior = PriorUp(cams_from_world, scene_center);
  Eigen::Vector3d up = Eigen::Vector3d::Zero();  // at first all axes weigh the same
  double roll = 0;                               // mean square sine to the level
  for (int i = 0; i < kReweightings; ++i) {
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    double weights = 0;
    for (const Pose& pose : cams_from_world) {
      const Eigen::Vector3d x = AxisInWorld(pose, Eigen::Vector3d::UnitX());
      const double weight = 1 / std::max(std::abs(x.dot(up)), kMinSine);
      squares += weight * x * x.transpose();
      weights += weight;
    }
    squares /= weights;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(
        squares - kWeightOfPrior * prior * prior.transpose());  // ascending
    up = axes.eigenvectors().col(0);
    roll = up.dot(squares * up);
  }
  if (!(roll <= kMaxRoll)) return prior;
  // Images from the air on one line: what their images call up is a direction of the compass and
  // does not tell the side. That is then where they do not look.
  const Eigen::Vector3d side = std::abs(up.dot(prior)) >= kTellsSide
                                   ? prior
                                   : -Sum(cams_from_world, Eigen::Vector3d::UnitZ());
  return up.dot(side) < 0 ? Eigen::Vector3d(-up) : up;
}

Eigen::Vector3d WorldUp(const DtrSet& set, size_t frame) {
  if (const auto known = KnownUp(set)) return *known;
  std::vector<Pose> poses;
  for (const View& view : set.frames.at(frame).views) {
    if (view.role == ViewRole::kSource) poses.push_back(view.cam_from_world);
  }
  return UpOfCameras(poses, set.scene_center);
}

Eigen::Vector3d UpInImages(std::span<const Pose> cams_from_world) {
  return CommonAxis(cams_from_world, -Eigen::Vector3d::UnitY());
}

}  // namespace dtr::viewer
