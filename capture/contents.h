// capture/contents.h -- what a folder of photos holds, and that in one line.
#pragma once
#include <string>
#include <vector>

namespace dtr::capture {

/// Files of one kind that are not used.
struct Ignored {
  std::string kind;    ///< "reduced_copies", "videos", "other_files", ...
  std::string what;    ///< for people: "reduced copies"
  std::string reason;  ///< why, or what to do; may be empty
  int files = 0;
  std::vector<std::string> where;  ///< folders below the given one, or extensions; no order
};

/// Counts of a folder's files.
struct FolderContents {
  int photos = 0;
  int masks = 0;       ///< files that are the mask of a photo
  int depth_maps = 0;  ///< recognised, used by `dtr import` alone
  int videos = 0;
  int cameras = 0;  ///< groups of photos that share intrinsics
  std::vector<Ignored> ignored;

  /// Adds files to the entry of that kind.
  void Ignore(const std::string& kind, const std::string& what, const std::string& reason,
              const std::string& where, int files = 1);
  /// Files of that kind are used after all.
  void Use(const std::string& kind);
};

/// "4 photos of 1 camera, 4 masks; ignored: reduced copies (8: images_2/, images_4/), ...".
std::string LineOf(const FolderContents& contents);

}  // namespace dtr::capture
