#include "datasets/list.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <system_error>

#include "datasets/scene.h"
#include "dtr/base/error.h"
#include "dtr/base/hash.h"
#include "dtr/base/parallel_for.h"

namespace dtr::datasets {

extern const char* const kPublicSetsJson;  // public_sets.json, built in

namespace {

using Json = nlohmann::ordered_json;

/// Throws nlohmann's exception on a broken table, which a test would show: it is part of the
/// program, not input.
const Json& PublicSets() {
  static const Json sets = Json::parse(kPublicSetsJson).at("sets");
  return sets;
}

const char* SummaryOf(const std::string& scene) {
  if (scene == "courtyard") {
    return "walled yard: columns, roofs, spheres, thin rods, a bare wall; sky closes every ray";
  }
  if (scene == "plane") return "one painted plane, tilted by 25 degrees, filling the frame";
  if (scene == "stairs") return "eight steps between walls";
  if (scene == "sphere") return "a ball of radius 1.5 before a painted wall";
  if (scene == "toys") return "a ball rolls, a crate slides, a box turns; all else stands still";
  if (scene == "plain-room") {
    return "the room with painted walls and ceiling, of which photos show next to nothing";
  }
  return "closed, furnished room, captured from its middle outwards";
}

const Json& PublicSet(const std::string& name) {
  for (const Json& set : PublicSets()) {
    if (set.at("name") == name) return set;
  }
  const std::vector<std::string> scenes = SceneNames();
  if (std::find(scenes.begin(), scenes.end(), name) != scenes.end()) {
    throw UsageError("'" + name + "' is not downloaded but made; use `dtr dataset make " + name +
                     "`");
  }
  throw UsageError("data set: expected a public set's name, found '" + name +
                   "'; see `dtr dataset list`");
}

}  // namespace

std::vector<DatasetInfo> ListDatasets() {
  std::vector<DatasetInfo> list;
  for (const std::string& scene : SceneNames()) {
    DatasetInfo info;
    info.name = scene;
    info.is_made_here = true;
    info.summary = SummaryOf(scene);
    info.layouts = MakeScene(scene, 1).framing().layouts;
    list.push_back(std::move(info));
  }
  for (const Json& set : PublicSets()) {
    DatasetInfo info;
    info.name = set.at("name");
    info.summary = set.at("summary");
    info.origin = set.at("origin");
    info.licence = set.at("licence");
    info.files = static_cast<int>(set.at("files").size());
    list.push_back(std::move(info));
  }
  return list;
}

DatasetCheck CheckPublicSet(const std::string& name, const std::filesystem::path& folder) {
  const Json& set = PublicSet(name);
  std::error_code failed;
  if (!std::filesystem::is_directory(folder, failed)) {
    throw Error(folder.string() + ": expected a folder with the set " + name +
                ", found none; it comes from " + set.at("origin").get<std::string>() +
                " (licence: " + set.at("licence").get<std::string>() + ")");
  }
  std::vector<std::pair<std::string, std::string>> files;
  for (const auto& [path, sha256] : set.at("files").items()) files.emplace_back(path, sha256);
  enum class State { kOk, kMissing, kChanged };
  std::vector<State> states(files.size());
  ParallelFor(0, static_cast<int>(files.size()), [&](int i) {
    const auto& [path, sha256] = files[static_cast<size_t>(i)];
    std::error_code ignored;
    State& state = states[static_cast<size_t>(i)];
    if (!std::filesystem::is_regular_file(folder / path, ignored)) {
      state = State::kMissing;
    } else {
      state = Sha256OfFile(folder / path) == sha256 ? State::kOk : State::kChanged;
    }
  });
  DatasetCheck check;
  check.name = name;
  for (size_t i = 0; i < files.size(); ++i) {
    if (states[i] == State::kOk) ++check.files_ok;
    if (states[i] == State::kMissing) check.missing.push_back(files[i].first);
    if (states[i] == State::kChanged) check.changed.push_back(files[i].first);
  }
  return check;
}

}  // namespace dtr::datasets
