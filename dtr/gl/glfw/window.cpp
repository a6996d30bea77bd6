#include "dtr/gl/glfw/window.h"

// epoxy's header must come before any other GL header.
#include <epoxy/gl.h>
// clang-format keeps this group apart.
#include <GLFW/glfw3.h>

#include <array>
#include <utility>

#include "dtr/base/error.h"
#include "dtr/gl/context.h"

namespace dtr::gl {
namespace {

// As dtr/gl/context.cpp: 4.3 is needed, newer is asked for first.
constexpr std::array<std::pair<int, int>, 3> kVersions{{{4, 5}, {4, 4}, {4, 3}}};

#ifdef NDEBUG
constexpr int kDebugContext = GLFW_FALSE;
#else
constexpr int kDebugContext = GLFW_TRUE;
#endif

std::string LastError() {
  const char* description = nullptr;
  return glfwGetError(&description) == GLFW_NO_ERROR || description == nullptr
             ? "no reason given"
             : std::string(description);
}

}  // namespace

class Window::Library {
 public:
  Library() {
    if (glfwInit() == GLFW_TRUE) return;
    throw Error("window: expected a display to open it on, found none (" + LastError() +
                "); set DISPLAY, or draw without a window: dtr render");
  }
  ~Library() { glfwTerminate(); }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

  /// One for all windows that live at a time.
  static std::shared_ptr<Library> Shared() {
    static std::weak_ptr<Library> shared;
    std::shared_ptr<Library> library = shared.lock();
    if (!library) shared = library = std::make_shared<Library>();
    return library;
  }
};

Window::Window(const WindowOptions& options) : library_(Library::Shared()) {
  std::string reason;
  for (const auto& [major, minor] : kVersions) {
    glfwDefaultWindowHints();
    glfwWindowHint(GLFW_CLIENT_API, GLFW_OPENGL_API);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, major);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, minor);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_DEBUG_CONTEXT, kDebugContext);
    glfwWindowHint(GLFW_VISIBLE, options.visible ? GLFW_TRUE : GLFW_FALSE);
    window_ = glfwCreateWindow(options.width_px, options.height_px, options.title.c_str(), nullptr,
                               nullptr);
    if (window_ != nullptr) break;
    reason = LastError();
  }
  if (window_ == nullptr) {
    throw Error(
        "window: expected OpenGL 4.3 or newer on this display, found an older one or none (" +
        reason + "); draw without a window: dtr render");
  }
  glfwMakeContextCurrent(window_);
}

Window::~Window() { glfwDestroyWindow(window_); }

void Window::MakeCurrent() { glfwMakeContextCurrent(window_); }

std::string Window::Description() const { return CurrentContextDescription(); }

void Window::Present() {
  glfwSwapBuffers(window_);
  glfwPollEvents();
}

bool Window::CloseRequested() const { return glfwWindowShouldClose(window_) == GLFW_TRUE; }

}  // namespace dtr::gl
