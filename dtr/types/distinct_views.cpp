#include "dtr/types/distinct_views.h"

#include <algorithm>
#include <cstring>
#include <unordered_map>

namespace dtr {
namespace {

std::string PoseBytes(const Pose& pose) {
  Eigen::Matrix<double, 7, 1> numbers;
  numbers << pose.rotation.coeffs(), pose.translation;
  numbers.array() += 0.0;  // -0 equals 0
  std::string bytes(sizeof(double) * static_cast<size_t>(numbers.size()), '\0');
  std::memcpy(bytes.data(), numbers.data(), bytes.size());
  return bytes;
}

}  // namespace

std::vector<size_t> DistinctViews(std::span<const View* const> views,
                                  const std::function<std::string(const View&)>& content,
                                  const std::function<bool(const View&, const View&)>& repeats) {
  std::unordered_map<std::string, std::vector<size_t>> alike;
  std::vector<size_t> distinct;
  for (size_t i = 0; i < views.size(); ++i) {
    const View& view = *views[i];
    std::vector<size_t>& before = alike[PoseBytes(view.cam_from_world) + content(view)];
    const auto repeated = [&](size_t other) { return repeats(*views[other], view); };
    if (std::any_of(before.begin(), before.end(), repeated)) continue;
    before.push_back(i);
    distinct.push_back(i);
  }
  return distinct;
}

}  // namespace dtr
