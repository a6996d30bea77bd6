// capture/folder_walk.h -- the files below a folder of photos, by what their names say they are.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "capture/contents.h"
#include "capture/photo.h"

namespace dtr::capture {

/// Files of a folder that may be photos, and what of the others is worth saying.
struct FolderWalk {
  std::vector<std::string>
      images;  ///< with an image extension; relative, '/' between parts, sorted
  std::vector<Skipped> skipped;
  std::vector<std::string> videos;
  FolderContents contents;  ///< what is ignored
};

/// Walks a folder, and with `recurse` those below it that are not IsOwnFolder, links to folders
/// among them; a folder that several ways lead to is read once, by the first of them. Files and
/// folders that systems leave behind (hidden ones, thumbnails of servers, resource forks) are
/// ignored. Throws Error when the folder cannot be listed.
FolderWalk WalkFolder(const std::filesystem::path& folder, bool recurse);

}  // namespace dtr::capture
