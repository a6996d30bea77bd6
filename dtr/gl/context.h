// dtr/gl/context.h -- an OpenGL context without a window; no GL header is needed to use it.
#pragma once
#include <memory>
#include <string>

namespace dtr::gl {

/// An OpenGL core context of version 4.3 or newer without window or display, made with EGL: a real
/// GPU where EGL lists one, else Mesa's software rasteriser. It is current on the thread that made
/// it and belongs to that thread.
class EglContext {
 public:
  /// Throws dtr::Error, one line that names --renderer cpu, where the machine has no EGL, no
  /// OpenGL, or none of version 4.3.
  EglContext();
  ~EglContext();
  /// One whose driver draws with a GPU, else null and in `why` the reason, half a line.
  static std::unique_ptr<EglContext> OnGpu(std::string& why);
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  void MakeCurrent();
  /// Renderer and version as the driver gives them, for reports: "llvmpipe (...), 4.5 ...".
  std::string Description() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The same of whatever context is current.
std::string CurrentContextDescription();

/// From now on the current context counts the errors, undefined behaviour and messages of high
/// severity that the driver reports (KHR_debug), and prints them to stderr. For tests and
/// development; builds without NDEBUG make their contexts as debug contexts, in which drivers say
/// more.
class DebugOutput {
 public:
  DebugOutput();
  ~DebugOutput();
  DebugOutput(const DebugOutput&) = delete;
  DebugOutput& operator=(const DebugOutput&) = delete;
  int errors() const { return *errors_; }

 private:
  std::unique_ptr<int> errors_;
};

}  // namespace dtr::gl
