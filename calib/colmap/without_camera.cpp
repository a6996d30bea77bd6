#include "calib/colmap/without_camera.h"

#include <fmt/format.h>

#include <cstdint>
#include <set>

#include "calib/colmap/database.h"

namespace dtr::colmap {
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
                                                    const calib::SfmModel& model, int min_common) {
  std::set<std::string> registered;
  for (const calib::SfmImage& image : model.images) registered.insert(image.name);
  std::map<std::string, std::string> reasons;
  if (registered.size() == workspace.images().size()) return reasons;
  const auto ids = ReadDatabaseIds(workspace.database());
  const DatabaseMatches matches = ReadDatabaseMatches(workspace.database());
  std::map<std::uint32_t, std::string> names;
  for (size_t i = 0; i < workspace.images().size(); ++i) {
    const auto found = ids.find(workspace.AliasOf(i));
    if (found != ids.end()) names[found->second.image_id] = workspace.images()[i].name;
  }
  std::map<std::string, InCommon> in_common;
  for (const DatabasePair& pair : matches.pairs) {
    for (const int side : {0, 1}) {
      const auto mine = names.find(pair.image_ids[side]);
      const auto theirs = names.find(pair.image_ids[1 - side]);
      if (mine == names.end() || theirs == names.end()) continue;
      InCommon& known = in_common[mine->second];
      (registered.contains(theirs->second) ? known.with_camera : known.without)
          .Add(pair.common, theirs->second);
    }
  }
  for (const auto& [id, name] : names) {
    if (registered.contains(name)) continue;
    const auto features = matches.features.find(id);
    reasons[name] = Reason(features == matches.features.end() ? 0 : features->second,
                           in_common[name], min_common);
  }
  return reasons;
}

}  // namespace dtr::colmap
