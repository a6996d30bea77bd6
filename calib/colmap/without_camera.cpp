#include "calib/colmap/without_camera.h"

#include <fmt/format.h>

#include <cstdint>
#include <set>

#include "calib/colmap/database.h"

namespace dtr::colmap {
namespace {

/// The photo that has most in common with another one.
struct Partner {
  std::int64_t common = 0;
  std::string name;

  void Consider(std::int64_t other_common, const std::string& other_name) {
    // Ties go to the first name: pairs come in no order of ours.
    if (other_common > common || (other_common == common && other_name < name)) {
      common = other_common;
      name = other_name;
    }
  }
};

struct Partners {
  Partner registered, other;
};

std::string Reason(std::int64_t features, const Partners& partners, int fewest_common) {
  const auto& [registered, other] = partners;
  if (features == 0) return "nothing in it to recognise";
  if (registered.common == 0 && other.common == 0) {
    return fmt::format("{} features, none of them in another photo", features);
  }
  if (registered.common == 0) {
    return fmt::format("in common with {} alone, which has no camera either ({} features)",
                       other.name, other.common);
  }
  return fmt::format("{} of its {} features in common with {}, with no photo more; {}",
                     registered.common, features, registered.name,
                     registered.common < fewest_common
                         ? fmt::format("a place takes {}", fewest_common)
                         : "they agree on no place");
}

}  // namespace

std::map<std::string, std::string> WhyWithoutCamera(const Workspace& workspace,
                                                    const calib::SfmModel& model,
                                                    int fewest_common) {
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
  std::map<std::string, Partners> partners;
  for (const DatabasePair& pair : matches.pairs) {
    for (const int side : {0, 1}) {
      const auto mine = names.find(pair.image_ids[side]);
      const auto theirs = names.find(pair.image_ids[1 - side]);
      if (mine == names.end() || theirs == names.end()) continue;
      Partners& known = partners[mine->second];
      (registered.contains(theirs->second) ? known.registered : known.other)
          .Consider(pair.common, theirs->second);
    }
  }
  for (const auto& [id, name] : names) {
    if (registered.contains(name)) continue;
    const auto features = matches.features.find(id);
    reasons[name] = Reason(features == matches.features.end() ? 0 : features->second,
                           partners[name], fewest_common);
  }
  return reasons;
}

}  // namespace dtr::colmap
