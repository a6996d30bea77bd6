// viewer/glfw/user_interface.h -- Dear ImGui in a GLFW window, and the input that is not ImGui's.
#pragma once
#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <variant>
#include <vector>

#include "viewer/glfw/keys.h"
#include "viewer/input.h"

struct GLFWwindow;

namespace dtr::viewer {

/// A key, and where the cursor was just then.
struct ActionInput {
  Action action = Action::kHelp;
  Eigen::Vector2d cursor_px{0, 0};
};
/// A file that was dropped onto the window.
struct FileInput {
  std::filesystem::path file;
};
using UserInput = std::variant<InputEvent, ActionInput, FileInput>;

/// One at a time; its context must be current. Input is kept in order, also what comes and goes
/// between two frames. What is done over a panel or typed into a field is ImGui's alone.
class UserInterface {
 public:
  explicit UserInterface(GLFWwindow* window);
  ~UserInterface();
  UserInterface(const UserInterface&) = delete;
  UserInterface& operator=(const UserInterface&) = delete;

  /// What came since the last call.
  std::vector<UserInput> Take();
  /// True when anything came since the last call, also for ImGui.
  bool TakeAnyInput();

  void BeginFrame();
  /// Draws what was asked for of ImGui since BeginFrame into framebuffer 0.
  void EndFrame();
  /// To be called inside an ImGui window: the cursor over it is ImGui's.
  void ThisPanelIsOurs();

  /// The cursor, pixels of the image; off it where the cursor is.
  Eigen::Vector2d cursor_px() const { return cursor_px_; }
  bool CursorOverPanels() const;

 private:
  struct Callbacks;
  friend struct Callbacks;
  Eigen::Vector2d ToImage(double x, double y) const;

  /// As GLFW tells it.
  struct KeyChange {
    int key = 0, scancode = 0, action = 0, mods = 0;
  };
  /// This ImGui looks at keys once a frame: one that comes and goes in between is let go later.
  void TellImGui(const KeyChange& change);

  GLFWwindow* window_;
  std::vector<UserInput> inputs_;
  std::vector<KeyChange> unseen_presses_, late_releases_;  ///< since ImGui's last frame
  std::vector<std::array<float, 4>> panels_, new_panels_;  ///< left, top, right, bottom
  Eigen::Vector2d cursor_px_{-1, -1};
  std::array<bool, 3> buttons_down_{};
  bool any_input_ = true;
};

}  // namespace dtr::viewer
