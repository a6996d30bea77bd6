#include "calib/sfm/run/without_camera.h"

#include <fmt/format.h>

#include <cstdint>
#include <set>
#include <utility>
#include <vector>

namespace dtr::sfm {
namespace {

/// COLMAP forgets pairs that have fewer features in common (TwoViewGeometry.min_num_inliers).
constexpr int kMinOfAPair = 15;

/// Of some photos the one that another photo has most in common with.
struct Partners {
  int count = 0;
  std::int64_t most = 0;
  std::string name;

  void Add(std::int64_t common, const std::string& other) {
    ++count;
    // Ties go to the first name: pairs come in no order of ours.
    if (common > most || (common == most && other < name)) {
      most = common;
      name = other;
    }
  }
};

struct InCommon {
  Partners with_camera, without;
};

std::string Reason(std::int64_t features, const InCommon& common, int min_common) {
  const auto& [with_camera, without] = common;
  if (features == 0) return "nothing in it to recognise";
  if (with_camera.count == 0 && without.count == 0) {
    return fmt::format("{} features, fewer than {} of them in any other photo", features,
                       kMinOfAPair);
  }
  if (with_camera.count == 0) {
    return fmt::format(
        "in common with {} alone that {} no camera either, most with {} ({} features)",
        without.count == 1 ? "a photo" : fmt::format("{} photos", without.count),
        without.count == 1 ? "has" : "have", without.name, without.most);
  }
  return fmt::format("{} of its {} features in common with {}, with no photo more; {}",
                     with_camera.most, features, with_camera.name,
                     with_camera.most < min_common
                         ? fmt::format("COLMAP registers a photo by {} that agree", min_common)
                         : "COLMAP found no pose that they agree on with those of other photos");
}

}  // namespace

std::map<std::string, std::string> WhyWithoutCamera(const Workspace& workspace,
                                                    const MatchSummary& matches,
                                                    const calib::SfmModel& model, int min_common) {
  std::set<std::string> registered;
  for (const calib::SfmImage& image : model.images) registered.insert(image.name);
  const auto& images = workspace.images();
  std::vector<InCommon> in_common(images.size());
  for (const MatchSummary::Pair& pair : matches.pairs) {
    for (const auto& [mine, theirs] : {std::pair(pair.a, pair.b), std::pair(pair.b, pair.a)}) {
      const std::string& name = images[theirs].name;
      InCommon& known = in_common[mine];
      (registered.contains(name) ? known.with_camera : known.without).Add(pair.common, name);
    }
  }
  std::map<std::string, std::string> reasons;
  for (size_t i = 0; i < images.size(); ++i) {
    if (registered.contains(images[i].name)) continue;
    reasons[images[i].name] = Reason(matches.features[i], in_common[i], min_common);
  }
  return reasons;
}

}  // namespace dtr::sfm
