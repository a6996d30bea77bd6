#include "viewer/glfw/widgets.h"

#include <numbers>

namespace dtr::viewer {
namespace {

constexpr double kDegreesPerRad = 180 / std::numbers::pi;
constexpr double kReportsThreshold = 3.5;  // scene units: the founding report's
constexpr auto kClamped = ImGuiSliderFlags_AlwaysClamp;
constexpr auto kLogarithmic = ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic;

}  // namespace

void Widgets::Note(const std::string& name, bool framed) {
  const ImVec2 from = ImGui::GetItemRectMin(), to = ImGui::GetItemRectMax();
  const float width = framed ? ImGui::CalcItemWidth() : to.x - from.x;
  places_.push_back({name, from.x, from.y, width, to.y - from.y, ImGui::IsItemVisible()});
}

bool Widgets::Header(const char* name) {
  const bool open = ImGui::CollapsingHeader(name, ImGuiTreeNodeFlags_DefaultOpen);
  Note(name, false);
  return open;
}

bool Widgets::Tree(const char* name) {
  const bool open = ImGui::TreeNode(name);
  Note(name, false);
  return open;
}

bool Widgets::Button(const char* name, const char* words) {
  const bool pressed = ImGui::Button(words);
  Note(name, false);
  return pressed;
}

bool Widgets::Arrow(const char* name, ImGuiDir direction) {
  const bool pressed = ImGui::ArrowButton(name, direction);
  Note(name, false);
  return pressed;
}

void Widgets::Check(const char* name, const char* words, bool& value) {
  ImGui::Checkbox(words, &value);
  Note(name, false);
}

void Widgets::Whole(const char* name, int& value, int low, int high, bool logarithmic) {
  ImGui::SliderInt(name, &value, low, high, "%d", logarithmic ? kLogarithmic : kClamped);
  Note(name, true);
}

void Widgets::Real(const char* name, double& value, double low, double high) {
  ImGui::SliderScalar(name, ImGuiDataType_Double, &value, &low, &high, "%.4g", kLogarithmic);
  Note(name, true);
}

void Widgets::Degrees(const char* name, double& rad, double low_deg, double high_deg) {
  double degrees = rad * kDegreesPerRad;
  if (ImGui::SliderScalar(name, ImGuiDataType_Double, &degrees, &low_deg, &high_deg, "%.0f deg",
                          kClamped)) {
    rad = degrees / kDegreesPerRad;
  }
  Note(name, true);
}

void Widgets::Share(const char* name, float& value) {
  ImGui::SliderFloat(name, &value, 0, 1, "%.2f", kClamped);
  Note(name, true);
}

void Widgets::Absolute(const char* name, std::optional<double>& value) {
  bool on = value.has_value();
  ImGui::PushID(name);
  if (ImGui::Checkbox("##on", &on)) {
    value = on ? std::optional(kReportsThreshold) : std::nullopt;
  }
  Note(std::string(name) + " on", false);
  ImGui::SameLine();
  double number = value.value_or(kReportsThreshold);
  // Narrower by the box before it, so that names begin below each other and none is cut.
  ImGui::PushItemWidth(ImGui::CalcItemWidth() - ImGui::GetFrameHeight() -
                       ImGui::GetStyle().ItemSpacing.x);
  ImGui::BeginDisabled(!on);
  Real(name, number, 1e-4, 1e4);
  ImGui::EndDisabled();
  ImGui::PopItemWidth();
  if (on) value = number;
  ImGui::PopID();
}

}  // namespace dtr::viewer
