// viewer/glfw/widgets.h -- the panel's controls: Dear ImGui's, told where they are.
#pragma once
#include <imgui.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "dtr/render/option_names.h"
#include "viewer/glfw/app.h"
#include "viewer/glfw/inspection.h"
#include "viewer/shown.h"

namespace dtr::viewer {

/// Controls of the current ImGui window, by the names that people read beside them. Each is noted
/// with its place, for scripts (AppState::controls).
class Widgets {
 public:
  explicit Widgets(std::vector<ControlPlace>& places) : places_(places) {}

  bool Header(const char* name);
  bool Tree(const char* name);
  bool Button(const char* name) { return Button(name, name); }
  /// A button whose words change with what it would do.
  bool Button(const char* name, const char* words);
  bool Arrow(const char* name, ImGuiDir direction);
  void Check(const char* name, bool& value) { Check(name, name, value); }
  void Check(const char* name, const char* words, bool& value);
  /// Sliders; logarithmic ones where values matter by their ratio.
  void Whole(const char* name, int& value, int low, int high, bool logarithmic = true);
  void Real(const char* name, double& value, double low, double high);
  void Degrees(const char* name, double& rad, double low_deg, double high_deg);
  void Share(const char* name, float& value);
  /// A threshold in scene units that replaces the scale-free one while it is ticked.
  void Absolute(const char* name, std::optional<double>& value);

  template <typename T, size_t N>
  void Choice(const char* name, T& value, const std::array<T, N>& choices) {
    const bool open = ImGui::BeginCombo(name, NameOf(value));
    Note(name, true);
    if (!open) return;
    for (const T choice : choices) {
      if (ImGui::Selectable(NameOf(choice), choice == value)) value = choice;
      Note(std::string(name) + "=" + NameOf(choice), false);
    }
    ImGui::EndCombo();
  }

 private:
  /// The place of the control that was drawn last; `framed`: without the words beside it.
  void Note(const std::string& name, bool framed);

  std::vector<ControlPlace>& places_;
};

}  // namespace dtr::viewer
