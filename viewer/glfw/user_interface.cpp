#include "viewer/glfw/user_interface.h"

// epoxy's header must come before any other GL header.
#include <epoxy/gl.h>
// clang-format keeps this group apart.
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace dtr::viewer {
namespace {

constexpr float kRounding = 4;

std::optional<Button> ButtonOf(int glfw_button) {
  switch (glfw_button) {
    case GLFW_MOUSE_BUTTON_LEFT:
      return Button::kLeft;
    case GLFW_MOUSE_BUTTON_RIGHT:
      return Button::kRight;
    case GLFW_MOUSE_BUTTON_MIDDLE:
      return Button::kMiddle;
    default:
      return std::nullopt;
  }
}

}  // namespace

/// GLFW calls these while events are handled; ImGui is told first.
struct UserInterface::Callbacks {
  static UserInterface& Of(GLFWwindow* window) {
    return *static_cast<UserInterface*>(glfwGetWindowUserPointer(window));
  }

  static void Key(GLFWwindow* window, int key, int scancode, int action, int mods) {
    UserInterface& self = Of(window);
    self.TellImGui({key, scancode, action, mods});
    self.any_input_ = true;
    if (action == GLFW_REPEAT) return;
    const bool pressed = action == GLFW_PRESS;
    const bool typing = ImGui::GetIO().WantTextInput;
    // Keys that are let go must never stay held.
    if (const auto fly = FlyKeyOf(key); fly && !(pressed && (typing || mods != 0))) {
      self.inputs_.emplace_back(FlyEvent{*fly, pressed});
    }
    const auto bound = pressed ? ActionOf(key, mods) : std::nullopt;
    // A field that is typed into takes all but quitting.
    if (!bound || (typing && bound != Action::kQuit)) return;
    self.inputs_.emplace_back(ActionInput{*bound, self.cursor_px_});
  }

  static void Character(GLFWwindow* window, unsigned code) {
    ImGui_ImplGlfw_CharCallback(window, code);
    UserInterface& self = Of(window);
    self.any_input_ = true;
    // Where '?' is differs between keyboards.
    if (code == '?' && !ImGui::GetIO().WantTextInput) {
      self.inputs_.emplace_back(ActionInput{Action::kHelp, self.cursor_px_});
    }
  }

  static void MouseButton(GLFWwindow* window, int glfw_button, int action, int mods) {
    ImGui_ImplGlfw_MouseButtonCallback(window, glfw_button, action, mods);
    UserInterface& self = Of(window);
    self.any_input_ = true;
    const auto button = ButtonOf(glfw_button);
    if (!button) return;
    bool& down = self.buttons_down_[static_cast<size_t>(*button)];
    const bool pressed = action == GLFW_PRESS;
    if (pressed ? self.CursorOverPanels() : !down) return;
    down = pressed;
    self.inputs_.emplace_back(
        ButtonEvent{*button, pressed, self.cursor_px_.x(), self.cursor_px_.y()});
  }

  static void Cursor(GLFWwindow* window, double x, double y) {
#if IMGUI_VERSION_NUM >= 18700
    ImGui_ImplGlfw_CursorPosCallback(window, x, y);  // earlier versions ask for it in every frame
#endif
    UserInterface& self = Of(window);
    self.any_input_ = true;
    self.cursor_px_ = self.ToImage(x, y);
    self.inputs_.emplace_back(MoveEvent{self.cursor_px_.x(), self.cursor_px_.y()});
  }

  static void Scroll(GLFWwindow* window, double x, double y) {
    ImGui_ImplGlfw_ScrollCallback(window, x, y);
    UserInterface& self = Of(window);
    self.any_input_ = true;
    if (self.CursorOverPanels()) return;
    self.inputs_.emplace_back(ScrollEvent{y, self.cursor_px_.x(), self.cursor_px_.y()});
  }

  static void Focus(GLFWwindow* window, int focused) {
    ImGui_ImplGlfw_WindowFocusCallback(window, focused);
    UserInterface& self = Of(window);
    self.any_input_ = true;
    if (focused == GLFW_FALSE) {
      self.buttons_down_.fill(false);
      self.inputs_.emplace_back(FocusLostEvent{});
    }
  }

  static void Enter(GLFWwindow* window, int entered) {
    ImGui_ImplGlfw_CursorEnterCallback(window, entered);
    Of(window).any_input_ = true;
  }

  static void Drop(GLFWwindow* window, int count, const char** files) {
    UserInterface& self = Of(window);
    self.any_input_ = true;
    for (int i = 0; i < count; ++i) self.inputs_.emplace_back(FileInput{files[i]});
  }

  static void Changed(GLFWwindow* window) { Of(window).any_input_ = true; }
  static void SizeChanged(GLFWwindow* window, int, int) { Of(window).any_input_ = true; }
};

UserInterface::UserInterface(GLFWwindow* window) : window_(window) {
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // leaves no file behind
  ImGui::StyleColorsDark();
  ImGui::GetStyle().WindowRounding = kRounding;
  ImGui::GetStyle().FrameRounding = kRounding;
  ImGui_ImplGlfw_InitForOpenGL(window, false);
  ImGui_ImplOpenGL3_Init("#version 430 core");
  glfwSetWindowUserPointer(window, this);
  glfwSetKeyCallback(window, &Callbacks::Key);
  glfwSetCharCallback(window, &Callbacks::Character);
  glfwSetMouseButtonCallback(window, &Callbacks::MouseButton);
  glfwSetCursorPosCallback(window, &Callbacks::Cursor);
  glfwSetScrollCallback(window, &Callbacks::Scroll);
  glfwSetWindowFocusCallback(window, &Callbacks::Focus);
  glfwSetCursorEnterCallback(window, &Callbacks::Enter);
  glfwSetWindowRefreshCallback(window, &Callbacks::Changed);
  glfwSetDropCallback(window, &Callbacks::Drop);
  glfwSetFramebufferSizeCallback(window, &Callbacks::SizeChanged);
}

UserInterface::~UserInterface() {
  glfwSetKeyCallback(window_, nullptr);
  glfwSetCharCallback(window_, nullptr);
  glfwSetMouseButtonCallback(window_, nullptr);
  glfwSetCursorPosCallback(window_, nullptr);
  glfwSetScrollCallback(window_, nullptr);
  glfwSetWindowFocusCallback(window_, nullptr);
  glfwSetCursorEnterCallback(window_, nullptr);
  glfwSetWindowRefreshCallback(window_, nullptr);
  glfwSetDropCallback(window_, nullptr);
  glfwSetFramebufferSizeCallback(window_, nullptr);
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
}

void UserInterface::TellImGui(const KeyChange& change) {
  const auto same_key = [&](const KeyChange& pressed) { return pressed.key == change.key; };
  const bool unseen = std::any_of(unseen_presses_.begin(), unseen_presses_.end(), same_key);
  if (change.action == GLFW_RELEASE && unseen) {
    late_releases_.push_back(change);
    return;
  }
  if (change.action == GLFW_PRESS) unseen_presses_.push_back(change);
  ImGui_ImplGlfw_KeyCallback(window_, change.key, change.scancode, change.action, change.mods);
}

std::vector<UserInput> UserInterface::Take() { return std::exchange(inputs_, {}); }

bool UserInterface::TakeAnyInput() { return std::exchange(any_input_, false); }

void UserInterface::BeginFrame() {
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  new_panels_.clear();
}

void UserInterface::EndFrame() {
  ImGui::Render();
  unseen_presses_.clear();
  for (const KeyChange& release : std::exchange(late_releases_, {})) {
    TellImGui(release);
    any_input_ = true;  // it takes another frame to see it
  }
  panels_ = std::exchange(new_panels_, {});
  int width_px = 0, height_px = 0;
  glfwGetFramebufferSize(window_, &width_px, &height_px);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glViewport(0, 0, width_px, height_px);
  glClearColor(0.11F, 0.12F, 0.13F, 1);
  glClear(GL_COLOR_BUFFER_BIT);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

void UserInterface::ThisPanelIsOurs() {
  const ImVec2 at = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
  new_panels_.push_back({at.x, at.y, at.x + size.x, at.y + size.y});
}

Eigen::Vector2d UserInterface::ToImage(double x, double y) const {
  int window_width = 1, window_height = 1, width_px = 1, height_px = 1;
  glfwGetWindowSize(window_, &window_width, &window_height);
  glfwGetFramebufferSize(window_, &width_px, &height_px);
  return {x * width_px / std::max(window_width, 1), y * height_px / std::max(window_height, 1)};
}

bool UserInterface::CursorOverPanels() const {
  // ImGui says so only since its last frame, which the cursor may have left behind.
  double x = 0, y = 0;
  glfwGetCursorPos(window_, &x, &y);
  const bool over = std::any_of(panels_.begin(), panels_.end(), [&](const auto& panel) {
    return x >= panel[0] && y >= panel[1] && x < panel[2] && y < panel[3];
  });
  // Menus that drop out of a panel take all clicks while they are open.
  return over ||
         ImGui::IsPopupOpen(nullptr, ImGuiPopupFlags_AnyPopupId | ImGuiPopupFlags_AnyPopupLevel);
}

}  // namespace dtr::viewer
