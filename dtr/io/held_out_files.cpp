#include "dtr/io/held_out_files.h"

#include <map>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/io/json_fields.h"
#include "dtr/io/set_json.h"

namespace dtr::io {
namespace {

constexpr char kHeldOutFormat[] = "dtr-held-out";
constexpr int kListVersion = 1;

template <typename Set>
auto HeldOutFilesOf(Set& set) {
  std::vector<decltype(&*set.frames[0].views[0].image_file)> files;
  for (auto& frame : set.frames) {
    for (auto& view : frame.views) {
      if (view.role != ViewRole::kHeldOut) continue;
      for (auto* file : {&view.image_file, &view.mask_file}) {
        if (*file) files.push_back(&**file);
      }
    }
  }
  return files;
}

}  // namespace

bool LacksHeldOutHashes(const DtrSet& set) {
  for (const StoredFile* file : HeldOutFilesOf(set)) {
    if (file->sha256.empty()) return true;
  }
  return false;
}

std::string HeldOutFilesJson(const DtrSet& set, const std::string& file) {
  const std::vector<const StoredFile*> stored = HeldOutFilesOf(set);
  if (stored.empty()) return "";
  Json root = {
      {"format", kHeldOutFormat}, {"format_version", kListVersion}, {"files", Json::array()}};
  for (const StoredFile* entry : stored) root["files"].push_back(JsonFromStoredFile(*entry));
  return PrettyJson(root, file);
}

void MergeHeldOutFiles(const std::string& text, const std::string& file, DtrSet& set) {
  const Json parsed = ParseJson(text, file);
  const JsonObject root(parsed, file, "");
  if (root.String("format") != kHeldOutFormat) root.Fail("format", "\"dtr-held-out\"");
  if (root.PositiveInt("format_version") != kListVersion) {
    root.Fail("format_version", std::to_string(kListVersion));
  }
  std::map<std::string, std::vector<StoredFile*>> wanted;
  for (StoredFile* stored : HeldOutFilesOf(set)) {
    if (stored->sha256.empty()) wanted[stored->path].push_back(stored);
  }
  const Json& files = root.Array("files");
  for (size_t i = 0; i < files.size(); ++i) {
    const JsonObject item = root.Item("files", i);
    const StoredFile stored = StoredFileFromJson(item);
    const auto named = wanted.find(stored.path);
    if (named == wanted.end()) item.Fail("path", "a held-out file of set.json, each once");
    for (StoredFile* same_file : named->second) *same_file = stored;
    wanted.erase(named);
  }
  if (!wanted.empty()) {
    root.Fail("files", "an entry for '" + wanted.begin()->first + "'", "none");
  }
}

}  // namespace dtr::io
