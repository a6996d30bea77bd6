#include "dtr/gl/context.h"

#include <dlfcn.h>
// epoxy's headers must come before any other GL header.
#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <array>
#include <cstdio>
#include <string_view>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/gl/driver.h"

namespace dtr::gl {
namespace {

// Compute shaders and storage buffers came with 4.3; 4.5 is asked for first.
constexpr std::array<std::pair<int, int>, 3> kVersions{{{4, 5}, {4, 4}, {4, 3}}};

#ifdef NDEBUG
constexpr EGLint kContextFlags = 0;
#else
constexpr EGLint kContextFlags = EGL_CONTEXT_OPENGL_DEBUG_BIT_KHR;
#endif

[[noreturn]] void Reject(const std::string& found) {
  throw Error("OpenGL: expected a context of version 4.3 or newer through EGL, found " + found +
              "; use `renderer` cpu or simd");
}

/// epoxy ends the program when a library is absent, so this asks first. Null, or the name of one
/// that is.
const char* MissingLibrary() {
  const auto is_there = [](const char* name) {
    return dlopen(name, RTLD_LAZY | RTLD_GLOBAL) != nullptr;
  };
  if (!is_there("libEGL.so.1")) return "libEGL.so.1";
  if (!is_there("libOpenGL.so.0") && !is_there("libGL.so.1")) return "libOpenGL.so.0";
  return nullptr;
}

bool HasWord(const char* list, std::string_view word) {
  std::string_view rest = list == nullptr ? "" : list;
  while (!rest.empty()) {
    const size_t end = std::min(rest.find(' '), rest.size());
    if (rest.substr(0, end) == word) return true;
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return false;
}

/// What EGL lists of its displays.
struct Displays {
  std::vector<EGLDisplay> hardware, software;
  bool lists_devices = false;  ///< else nothing is known of the hardware
};

Displays FindDisplays() {
  Displays displays;
  auto& [hardware, software, lists_devices] = displays;
  const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const auto platform_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
      eglGetProcAddress("eglGetPlatformDisplayEXT"));
  if (platform_display == nullptr) return displays;
  const auto query_devices =
      reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(eglGetProcAddress("eglQueryDevicesEXT"));
  const auto device_string = reinterpret_cast<PFNEGLQUERYDEVICESTRINGEXTPROC>(
      eglGetProcAddress("eglQueryDeviceStringEXT"));
  if (HasWord(extensions, "EGL_EXT_platform_device") && query_devices != nullptr &&
      device_string != nullptr) {
    lists_devices = true;
    std::array<EGLDeviceEXT, 16> devices{};
    EGLint count = 0;
    query_devices(static_cast<EGLint>(devices.size()), devices.data(), &count);
    for (EGLint i = 0; i < count; ++i) {
      EGLDeviceEXT device = devices[static_cast<size_t>(i)];
      const bool is_software =
          HasWord(device_string(device, EGL_EXTENSIONS), "EGL_MESA_device_software");
      (is_software ? software : hardware)
          .push_back(platform_display(EGL_PLATFORM_DEVICE_EXT, device, nullptr));
    }
  }
  if (HasWord(extensions, "EGL_MESA_platform_surfaceless")) {
    software.insert(software.begin(),
                    platform_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
  }
  return displays;
}

/// Displays to try: devices with hardware first, software last, then what needs no device.
std::vector<EGLDisplay> CandidateDisplays() {
  Displays displays = FindDisplays();
  displays.hardware.insert(displays.hardware.end(), displays.software.begin(),
                           displays.software.end());
  return displays.hardware;
}

EGLContext CreateContext(EGLDisplay display) {
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return EGL_NO_CONTEXT;
  const EGLint config_attributes[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE,
                                      EGL_PBUFFER_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  if (eglChooseConfig(display, config_attributes, &config, 1, &count) != EGL_TRUE || count < 1) {
    return EGL_NO_CONTEXT;
  }
  for (const auto& [major, minor] : kVersions) {
    const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                 major,
                                 EGL_CONTEXT_MINOR_VERSION,
                                 minor,
                                 EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                 EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                 EGL_CONTEXT_FLAGS_KHR,
                                 kContextFlags,
                                 EGL_NONE};
    const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, attributes);
    if (context != EGL_NO_CONTEXT) return context;
  }
  return EGL_NO_CONTEXT;
}

void APIENTRY OnMessage(GLenum source, GLenum type, GLuint, GLenum severity, GLsizei,
                        const GLchar* message, const void* user) {
  if (type != GL_DEBUG_TYPE_ERROR && type != GL_DEBUG_TYPE_UNDEFINED_BEHAVIOR &&
      severity != GL_DEBUG_SEVERITY_HIGH) {
    return;
  }
  // Whoever compiles a shader reads its log and throws.
  if (source == GL_DEBUG_SOURCE_SHADER_COMPILER) return;
  ++*static_cast<int*>(const_cast<void*>(user));
  std::fprintf(stderr, "OpenGL: %s\n", message);
}

}  // namespace

struct EglContext::State {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
};

EglContext::EglContext() : state_(std::make_unique<State>()) {
  if (const char* const missing = MissingLibrary()) Reject(std::string("no ") + missing);
  bool any_display = false;
  for (const EGLDisplay display : CandidateDisplays()) {
    EGLint major = 0, minor = 0;
    if (display == EGL_NO_DISPLAY || eglInitialize(display, &major, &minor) != EGL_TRUE) continue;
    any_display = true;
    const EGLContext context = CreateContext(display);
    if (context == EGL_NO_CONTEXT) continue;
    if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) == EGL_TRUE) {
      state_->display = display;
      state_->context = context;
      return;
    }
    eglDestroyContext(display, context);
  }
  Reject(any_display ? "only older ones" : "no display that EGL can open");
}

std::unique_ptr<EglContext> EglContext::OnGpu(std::string& why) {
  why = "no GPU was found";
  if (MissingLibrary() != nullptr) return nullptr;
  // A software driver's context takes tens of milliseconds: not where devices are listed.
  const Displays displays = FindDisplays();
  if (displays.lists_devices && displays.hardware.empty()) return nullptr;
  try {
    auto context = std::make_unique<EglContext>();
    if (!DrawsOnProcessor()) return context;
  } catch (const Error&) {
    why = "the GPU's driver has no OpenGL 4.3";
  }
  return nullptr;
}

EglContext::~EglContext() {
  // The display stays initialised: it belongs to the process, and other contexts may use it.
  eglMakeCurrent(state_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(state_->display, state_->context);
}

void EglContext::MakeCurrent() {
  if (eglMakeCurrent(state_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, state_->context) !=
      EGL_TRUE) {
    throw Error("OpenGL: the context cannot be made current; is it current on another thread?");
  }
}

std::string EglContext::Description() const { return CurrentContextDescription(); }

std::string CurrentContextDescription() {
  const auto text = [](GLenum name) {
    const GLubyte* value = glGetString(name);
    return std::string(value == nullptr ? "unknown" : reinterpret_cast<const char*>(value));
  };
  return text(GL_RENDERER) + ", OpenGL " + text(GL_VERSION);
}

DebugOutput::DebugOutput() : errors_(std::make_unique<int>(0)) {
  glEnable(GL_DEBUG_OUTPUT);
  glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
  glDebugMessageCallback(&OnMessage, errors_.get());
}

DebugOutput::~DebugOutput() {
  glDebugMessageCallback(nullptr, nullptr);
  glDisable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
  glDisable(GL_DEBUG_OUTPUT);
}

}  // namespace dtr::gl
