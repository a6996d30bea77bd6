// Of set_json.h: the files that a set names.
#include <algorithm>

#include "dtr/base/error.h"
#include "dtr/io/set_json.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

std::string PlaceProblemOf(const fs::path& set_folder, const NamedFile& named) {
  std::error_code error;
  const fs::path root = fs::canonical(set_folder, error);
  if (error) return named.field + ".path: the set's folder cannot be read: " + error.message();
  const fs::path full = fs::weakly_canonical(root / named.file->path, error);
  if (error ||
      std::mismatch(root.begin(), root.end(), full.begin(), full.end()).first != root.end()) {
    return named.field + ".path: expected a file inside the set's folder, found '" +
           named.file->path + "', which leads to " + full.string();
  }
  return "";
}

}  // namespace

std::vector<NamedFile> FilesOf(const DtrSet& set) {
  std::vector<NamedFile> files;
  const auto add = [&](const std::optional<StoredFile>& file, const std::string& field,
                       bool only_saves_time = false) {
    if (file) files.push_back({&*file, field, only_saves_time});
  };
  add(set.sparse_file, "sparse");
  for (size_t f = 0; f < set.frames.size(); ++f) {
    for (size_t i = 0; i < set.frames[f].views.size(); ++i) {
      const View& view = set.frames[f].views[i];
      const std::string field =
          "frames[" + std::to_string(f) + "].views[" + std::to_string(i) + "].";
      add(view.image_file, field + "image");
      add(view.mask_file, field + "mask");
      add(view.depth_file, field + "depth");
      add(view.depth_base, field + "depth.base");
      add(view.completed_file, field + "completed_depth");
      add(view.completed_base, field + "completed_depth.base");
      add(view.sigma_file, field + "sigma");
      add(view.sigma_base, field + "sigma.base");
      add(view.mesh_file, field + "mesh", true);
    }
  }
  return files;
}

std::string ProblemOf(const fs::path& set_folder, const NamedFile& named) {
  if (std::string problem = PlaceProblemOf(set_folder, named); !problem.empty()) return problem;
  std::error_code error;
  const fs::path full = set_folder / named.file->path;
  const std::string shown = "'" + named.file->path + "'";
  if (!fs::is_regular_file(full, error)) {
    return named.field + ".path: expected a file, found nothing at " + shown;
  }
  const auto size = fs::file_size(full, error);
  if (error || size != named.file->bytes) {
    return named.field + ".bytes: expected " + std::to_string(named.file->bytes) +
           " bytes as recorded, found " + std::to_string(size) + " in " + shown;
  }
  return "";
}

void ExpectFiles(const fs::path& set_folder, const DtrSet& set) {
  for (const NamedFile& named : FilesOf(set)) {
    // A mesh only saves time: whoever loads it says what is wrong with it and goes on without.
    const std::string problem =
        named.only_saves_time ? PlaceProblemOf(set_folder, named) : ProblemOf(set_folder, named);
    if (!problem.empty()) throw Error((set_folder / kSetFile).string() + ": " + problem);
  }
}

}  // namespace dtr::io
