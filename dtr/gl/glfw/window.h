// dtr/gl/glfw/window.h -- an OpenGL context with a window; no GL or GLFW header is needed to use
// it.
#pragma once
#include <memory>
#include <string>

struct GLFWwindow;

namespace dtr::gl {

struct WindowOptions {
  int width_px = 1280, height_px = 720;
  std::string title = "dtr";
  bool visible = true;  ///< false: a context only, for what must share a display's driver
};

/// A window with an OpenGL core context of version 4.3 or newer, made with GLFW; the counterpart of
/// EglContext where there is a display. Its context is current on the thread that made it, which
/// must be the program's first (GLFW's rule) and the one that uses it.
class Window {
 public:
  /// Throws dtr::Error, one line, where no display can be opened or its driver has no OpenGL 4.3.
  explicit Window(const WindowOptions& options = {});
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  void MakeCurrent();
  /// As EglContext::Description.
  std::string Description() const;
  /// Shows what was drawn into framebuffer 0, and handles the events that have come.
  void Present();
  bool CloseRequested() const;
  /// For callbacks and input.
  GLFWwindow* handle() const { return window_; }

 private:
  class Library;
  std::shared_ptr<Library> library_;  ///< initialised while any window lives
  GLFWwindow* window_ = nullptr;
};

}  // namespace dtr::gl
