// viewer/glfw/keeper.h -- files that the user of the window asks for.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "dtr/types/dtr_set.h"
#include "viewer/glfw/picture_maker.h"

struct GLFWwindow;

namespace dtr::viewer {

/// Writes into one folder under names that are still free: STEM-picture-001.png, ... Everything
/// throws dtr::Error where it cannot write.
class Keeper {
 public:
  Keeper(std::filesystem::path folder, std::string stem)
      : folder_(std::move(folder)), stem_(std::move(stem)) {}

  /// The last picture made: colours as `dtr render` writes them, false colours as shown.
  std::filesystem::path SavePicture(PictureMaker& maker) const;
  /// The window as drawn but not yet presented.
  std::filesystem::path SaveWindow(GLFWwindow* window) const;
  /// cameras.json of one camera in the set's world.
  std::filesystem::path SaveCamera(const NovelCamera& camera, const DtrSet& set) const;
  /// Adds a camera to the path of this session, a cameras.json that `dtr render --path` reads; the
  /// first one begins a new file.
  std::filesystem::path AddToPath(const NovelCamera& camera, const DtrSet& set);

 private:
  std::filesystem::path Free(const std::string& kind, const std::string& extension) const;

  std::filesystem::path folder_;
  std::string stem_;
  std::filesystem::path path_file_;  ///< empty: none yet
  std::vector<NovelCamera> path_;
};

/// What is in framebuffer 0 of the current context, as PNG or JPEG by the file's extension.
void SaveWindowAs(const std::filesystem::path& file, GLFWwindow* window);

}  // namespace dtr::viewer
