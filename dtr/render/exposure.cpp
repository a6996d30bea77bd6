#include "dtr/render/exposure.h"

#include <algorithm>

#include "dtr/render/colour.h"
#include "dtr/render/frame.h"

namespace dtr {
namespace {

/// Turning by an angle counts as moving by this share of the arc about the scene centre.
constexpr double kTurnShare = 0.3;
/// What is clipped is no colour at all in a photo that is e^(1/4) times as bright as the image.
constexpr double kClippedPerLogExposure = 4;
/// A view nearer than this share of its distance from the scene centre is at the frame's place.
constexpr double kSamePlace = 1e-6;

}  // namespace

double ClippedOf(const View& view, const Eigen::Vector3d& exposure) {
  const double log_ratio = (view.gain.array() * exposure.array()).log().mean();
  return std::clamp(-kClippedPerLogExposure * log_ratio, 0.0, 1.0);
}

Eigen::Vector3d FrameExposure(const RenderScene& scene, const ViewSelection& selection,
                              const Pose& novel_from_world) {
  const std::vector<double> cut_factors = CutFactors(selection, selection.views.size());
  std::vector<double> cut_factor_of(scene.views.size());
  for (size_t k = 0; k < cut_factors.size(); ++k) {
    cut_factor_of[static_cast<size_t>(selection.views[k])] = cut_factors[k];
  }
  const Eigen::Vector3d novel_center = novel_from_world.TargetOriginInSource();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double total = 0;
  bool any = false;
  for (const int index : CanonicalOrder(scene, selection.views)) {
    const View& view = *scene.views[static_cast<size_t>(index)];
    any = any || view.gain != Eigen::Vector3d::Ones();
    const Eigen::Vector3d center = view.CenterInWorld();
    const double reach = (center - scene.center).norm();
    const double turn = novel_from_world.rotation.angularDistance(view.cam_from_world.rotation);
    const double apart = std::max(
        std::hypot((center - novel_center).norm(), kTurnShare * reach * turn), kSamePlace * reach);
    const double weight =
        apart > 0 ? cut_factor_of[static_cast<size_t>(index)] / (apart * apart) : 1;
    sum += weight * view.gain.array().log().matrix();
    total += weight;
  }
  if (!any || !(total > 0)) return Eigen::Vector3d::Ones();
  return (-sum / total).array().exp().matrix();
}

ExposureCurve::ExposureCurve(const Eigen::Vector3d& exposure) {
  for (size_t c = 0; c < 3; ++c) {
    for (size_t v = 0; v < 256; ++v) {
      values_[c][v] =
          Srgb8FromLinear(Exposed(LinearFromSrgb8()[v], exposure[static_cast<Eigen::Index>(c)]));
    }
  }
}

void ExposureCurve::Apply(ImageRgb8& image) const {
  for (size_t i = 0; i < image.data().size(); ++i) {
    image.data()[i] = values_[i % 3][image.data()[i]];
  }
}

void ExposureCurve::Apply(std::span<std::uint32_t> rgba) const {
  for (std::uint32_t& pixel : rgba) {
    pixel = (pixel & 0xff000000u) | std::uint32_t{values_[0][pixel & 0xff]} |
            std::uint32_t{values_[1][pixel >> 8 & 0xff]} << 8 |
            std::uint32_t{values_[2][pixel >> 16 & 0xff]} << 16;
  }
}

std::optional<ExposureCurve> CurveOf(const Eigen::Vector3d& exposure) {
  if (exposure == Eigen::Vector3d::Ones()) return std::nullopt;
  return ExposureCurve(exposure);
}

}  // namespace dtr
