// viewer/glfw/file_saver.h -- files that the user of the window asks for.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "dtr/types/dtr_set.h"
#include "viewer/glfw/frame_maker.h"

struct GLFWwindow;

namespace dtr::viewer {

/// Writes into one folder under names that are still free: STEM-image-001.png, ... Everything
/// throws dtr::Error where it cannot write.
class FileSaver {
 public:
  FileSaver(std::filesystem::path folder, std::string stem)
      : folder_(std::move(folder)), stem_(std::move(stem)) {}

  /// The last image made: colours as `dtr render` writes them, false colours as shown.
  std::filesystem::path SaveImage(FrameMaker& maker) const;
  /// The window as drawn but not yet presented.
  std::filesystem::path SaveWindow(GLFWwindow* window) const;
  /// cameras.json of one camera in the set's world.
  std::filesystem::path SaveCamera(const NovelCamera& camera, const DtrSet& set) const;
  /// cameras.json of a path in the set's world, that `dtr render --path` reads, always into the
  /// same file; the first call begins a new one.
  std::filesystem::path SavePath(const std::vector<NovelCamera>& path, const DtrSet& set);
  /// Leaves that file as it is: the next path goes into another.
  void BeginNewPath() { path_file_.clear(); }
  /// A name for a video, and beside it cameras.json of its frames.
  std::filesystem::path NameVideo(const std::vector<NovelCamera>& frames, const DtrSet& set) const;

 private:
  /// A name that no file has with any of these extensions; with the first.
  std::filesystem::path Free(const std::string& kind,
                             const std::vector<std::string>& extensions) const;

  std::filesystem::path folder_;
  std::string stem_;
  std::filesystem::path path_file_;  ///< empty: none yet
};

/// What is in framebuffer 0 of the current context, as PNG or JPEG by the file's extension.
void SaveWindowAs(const std::filesystem::path& file, GLFWwindow* window);

}  // namespace dtr::viewer
