#include "calib/solve/rig.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace dtr::calib {

const LensCamera& LargestImage(const Rig& rig) {
  const auto side = [](const RigCamera& c) {
    return std::max(c.camera.width_px, c.camera.height_px);
  };
  return std::max_element(rig.cameras.begin(), rig.cameras.end(),
                          [&](const auto& a, const auto& b) { return side(a) < side(b); })
      ->camera;
}

RigLayout::RigLayout(const std::vector<RigCamera>& cameras, bool free_lenses)
    : free_lenses_(free_lenses) {
  static constexpr const char* kPlace[] = {"turn_x_rad", "turn_y_rad", "turn_z_rad",
                                           "shift_x",    "shift_y",    "shift_z"};
  const auto add = [&](const std::string& camera, const std::string& what) {
    names_.push_back(cameras.size() > 1 ? camera + " " + what : what);
    ++size_;
  };
  for (const RigCamera& camera : cameras) {
    lens_at_.push_back(free_lenses ? size_ : -1);
    if (!free_lenses) continue;
    for (const std::string& name : FreeParameterNames(camera.model)) add(camera.name, name);
  }
  for (size_t c = 0; c < cameras.size(); ++c) {
    place_at_.push_back(c > 0 ? size_ : -1);
    if (c == 0) continue;
    for (const char* name : kPlace) add(cameras[c].name, name);
  }
}

Eigen::VectorXd Difference(const RigLayout& layout, const std::vector<RigCamera>& a,
                           const std::vector<RigCamera>& b) {
  Eigen::VectorXd difference = Eigen::VectorXd::Zero(layout.size());
  for (size_t c = 0; c < a.size(); ++c) {
    if (layout.LensAt(c) >= 0) {
      for (int k = 0; k < FreeParameterCount(a[c].model); ++k) {
        const auto i = static_cast<size_t>(k);
        difference[layout.LensAt(c) + k] = a[c].camera.params[i] - b[c].camera.params[i];
      }
    }
    if (layout.PlaceAt(c) >= 0) {
      const Eigen::AngleAxisd turn(a[c].cam_from_rig.rotation *
                                   b[c].cam_from_rig.rotation.conjugate());
      difference.segment<3>(layout.PlaceAt(c)) = turn.angle() * turn.axis();
      difference.segment<3>(layout.PlaceAt(c) + 3) =
          a[c].cam_from_rig.translation - b[c].cam_from_rig.translation;
    }
  }
  return difference;
}

}  // namespace dtr::calib
