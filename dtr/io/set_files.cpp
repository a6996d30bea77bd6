// Of set_json.h: the files that a set names.
#include <algorithm>
#include <unordered_map>
#include <utility>

#include "dtr/base/error.h"
#include "dtr/io/set_json.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

/// Compares a set's files with what it says of them. Folders are followed once and not for each of
/// their files, which are many.
class FileChecks {
 public:
  explicit FileChecks(fs::path set_folder)
      : folder_(std::move(set_folder)), root_(fs::canonical(folder_, root_error_)) {}

  std::string PlaceProblemOf(const NamedFile& named) {
    if (root_error_) {
      return named.field + ".path: the set's folder cannot be read: " + root_error_.message();
    }
    const fs::path path = root_ / named.file->path;
    std::error_code error;
    const bool is_no_link = fs::symlink_status(path, error).type() == fs::file_type::regular;
    if (is_no_link && IsInsideFolder(path.parent_path())) return "";
    const fs::path full = fs::weakly_canonical(path, error);
    if (!error && IsInside(full)) return "";
    return named.field + ".path: expected a file inside the set's folder, found '" +
           named.file->path + "', which leads to " + full.string();
  }

  std::string ProblemOf(const NamedFile& named) {
    if (std::string problem = PlaceProblemOf(named); !problem.empty()) return problem;
    std::error_code error;
    const fs::path full = folder_ / named.file->path;
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

 private:
  bool IsInside(const fs::path& full) const {
    return std::mismatch(root_.begin(), root_.end(), full.begin(), full.end()).first == root_.end();
  }
  bool IsInsideFolder(const fs::path& folder) {
    const auto [known, is_new] = inside_.try_emplace(folder.string(), false);
    if (is_new) {
      std::error_code error;
      const fs::path full = fs::canonical(folder, error);
      known->second = !error && IsInside(full);
    }
    return known->second;
  }

  const fs::path folder_;
  std::error_code root_error_;
  const fs::path root_;
  std::unordered_map<std::string, bool> inside_;  ///< folders that files were found in
};

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
  return FileChecks(set_folder).ProblemOf(named);
}

void ExpectFiles(const fs::path& set_folder, const DtrSet& set) {
  FileChecks checks(set_folder);
  for (const NamedFile& named : FilesOf(set)) {
    // A mesh only saves time: whoever loads it says what is wrong with it and goes on without.
    const std::string problem =
        named.only_saves_time ? checks.PlaceProblemOf(named) : checks.ProblemOf(named);
    if (!problem.empty()) throw Error((set_folder / kSetFile).string() + ": " + problem);
  }
}

}  // namespace dtr::io
