// pipeline/core/cameras/photo_names.h -- which photo a path in another program's file means.
#pragma once
#include <map>
#include <string>
#include <vector>

namespace dtr::pipeline {

/// The photos of a folder by their names below it.
class PhotoNames {
 public:
  explicit PhotoNames(std::vector<std::string> names);

  /// The photos that `path` may mean; one where it is clear, none where it is none of them. A path
  /// may be absolute, of another computer, have '\' for '/', lead through other folders or leave
  /// the extension away (Metashape's labels). Of the photos called so those count whose folders do
  /// not contradict the path's, and of them those that agree with it farthest; an equal extension
  /// comes before one in other letters, that before a path without the extension of an image.
  std::vector<std::string> Meant(const std::string& path) const;

  const std::vector<std::string>& names() const { return names_; }

 private:
  std::vector<std::string> names_;
  std::multimap<std::string, size_t> by_base_;  // base name without extension, in lower case
};

}  // namespace dtr::pipeline
