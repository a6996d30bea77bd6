#include "viewer/glfw/file_saver.h"

// epoxy's header must come before any other GL header.
#include <epoxy/gl.h>
// clang-format keeps this group apart.
#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/image_io.h"

namespace dtr::viewer {

namespace fs = std::filesystem;

namespace {

/// Named by the file and their numbers.
void WriteCameras(const fs::path& file, const std::vector<NovelCamera>& cameras,
                  const DtrSet& set) {
  io::CameraList list;
  list.unit = set.unit;
  list.world_origin = set.world_origin;
  for (const NovelCamera& camera : cameras) {
    io::NamedCamera named;
    named.name = fmt::format("{}-{:04}.png", file.stem().string(), list.cameras.size() + 1);
    named.camera = camera.camera;
    named.cam_from_world = camera.cam_from_world;
    list.cameras.push_back(named);
  }
  io::WriteCamerasJson(file, list);
}

}  // namespace

fs::path FileSaver::Free(const std::string& kind,
                         const std::vector<std::string>& extensions) const {
  constexpr int kMaxFiles = 100000;
  for (int number = 1; number < kMaxFiles; ++number) {
    const std::string stem = fmt::format("{}-{}-{:03}", stem_, kind, number);
    const bool taken = std::any_of(
        extensions.begin(), extensions.end(),
        [&](const std::string& extension) { return fs::exists(folder_ / (stem + extension)); });
    if (!taken) return folder_ / (stem + extensions.front());
  }
  throw Error(folder_.string() + ": expected a free name for " + stem_ + "-" + kind +
              ", found all taken; give another folder");
}

fs::path FileSaver::SaveImage(FrameMaker& maker) const {
  const MadeFrame& picture = maker.picture();
  const fs::path file = Free("image", {".png"});
  if (picture.shown != Shown::kColour || picture.options.fill_holes) {
    io::WriteImage(file, maker.Image(), io::kDefaultJpegQuality, io::Mark::kRendered);
  } else {
    io::WriteImageWithAlpha(file, maker.Image(), maker.Result().coverage, io::Mark::kRendered);
  }
  return file;
}

fs::path FileSaver::SaveWindow(GLFWwindow* window) const {
  const fs::path file = Free("window", {".png"});
  SaveWindowAs(file, window);
  return file;
}

fs::path FileSaver::SaveCamera(const NovelCamera& camera, const DtrSet& set) const {
  const fs::path file = Free("camera", {".json"});
  WriteCameras(file, {camera}, set);
  return file;
}

fs::path FileSaver::SavePath(const std::vector<NovelCamera>& path, const DtrSet& set) {
  if (path_file_.empty()) path_file_ = Free("path", {".json"});
  WriteCameras(path_file_, path, set);
  return path_file_;
}

fs::path FileSaver::NameVideo(const std::vector<NovelCamera>& frames, const DtrSet& set) const {
  const fs::path video = Free("video", {".mp4", ".json"});
  WriteCameras(fs::path(video).replace_extension(".json"), frames, set);
  return video;
}

void SaveWindowAs(const fs::path& file, GLFWwindow* window) {
  int width_px = 0, height_px = 0;
  glfwGetFramebufferSize(window, &width_px, &height_px);
  ImageRgb8 image(std::max(width_px, 1), std::max(height_px, 1), 3);
  ImageRgb8 upside_down = image;
  glBindFramebuffer(GL_READ_FRAMEBUFFER, 0);
  glReadBuffer(GL_BACK);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, image.width(), image.height(), GL_RGB, GL_UNSIGNED_BYTE,
               upside_down.data().data());
  const auto row_bytes = static_cast<std::ptrdiff_t>(3) * image.width();
  for (int y = 0; y < image.height(); ++y) {
    const std::uint8_t* row = upside_down.row(image.height() - 1 - y);
    std::copy(row, row + row_bytes, image.row(y));
  }
  io::WriteImage(file, image, io::kDefaultJpegQuality, io::Mark::kRendered);
}

}  // namespace dtr::viewer
