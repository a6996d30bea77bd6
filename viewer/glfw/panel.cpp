#include "viewer/glfw/panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include <numbers>

#include "dtr/render/option_names.h"

namespace dtr::viewer {
namespace {

constexpr float kPanelWidth = 330, kMargin = 8, kItemWidth = 150;
constexpr double kDegreesPerRad = 180 / std::numbers::pi;

void Text(const std::string& line) { ImGui::TextUnformatted(line.c_str()); }

template <typename T, size_t N>
void Choice(const char* label, T& value, const std::array<T, N>& choices) {
  if (!ImGui::BeginCombo(label, NameOf(value))) return;
  for (const T choice : choices) {
    if (ImGui::Selectable(NameOf(choice), choice == value)) value = choice;
  }
  ImGui::EndCombo();
}

void Whole(const char* label, int& value, int low, int high) {
  ImGui::SliderInt(label, &value, low, high, "%d",
                   ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic);
}

void Real(const char* label, double& value, double low, double high) {
  ImGui::SliderScalar(label, ImGuiDataType_Double, &value, &low, &high, "%.4g",
                      ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic);
}

/// A threshold in scene units that replaces the scale-free one while it is ticked.
void Absolute(const char* label, std::optional<double>& value) {
  bool on = value.has_value();
  ImGui::PushID(label);
  if (ImGui::Checkbox("##on", &on)) {
    value = on ? std::optional(3.5) : std::nullopt;  // the founding report's
  }
  ImGui::SameLine();
  double number = value.value_or(3.5);
  ImGui::BeginDisabled(!on);
  Real(label, number, 1e-4, 1e4);
  ImGui::EndDisabled();
  if (on) value = number;
  ImGui::PopID();
}

void RenderControls(RenderOptions& options) {
  Choice("method", options.method, kRenderMethods);
  const Primitive before = options.primitive;
  Choice("primitive", options.primitive, kPrimitives);
  // As on the command line: asking for splats picks the method that has them.
  if (options.primitive != before && options.primitive == Primitive::kSplat) {
    options.method = RenderMethod::kTwoPass;
  }
  Whole("views", options.views, 1, 64);
  Whole("resolution", options.resolution, 1, 64);
  Choice("blend", options.blend, kBlendWeights);
  if (options.blend == BlendWeight::kCosine) Real("exponent", options.exponent, 0, 1000);
  if (options.blend == BlendWeight::kExponential) Real("falloff", options.falloff, 0, 1000);
  if (options.blend == BlendWeight::kInverseAngle || options.blend == BlendWeight::kKNearest) {
    Whole("blend-k", options.blend_k, 1, 64);
  }
  double degrees = options.max_angle_rad * kDegreesPerRad;
  const double low = 1, high = 180;
  if (ImGui::SliderScalar("max-angle", ImGuiDataType_Double, &degrees, &low, &high, "%.0f deg",
                          ImGuiSliderFlags_AlwaysClamp)) {
    options.max_angle_rad = degrees * std::numbers::pi / 180;
  }
  if (options.primitive == Primitive::kSplat) {
    Real("point-size", options.point_size, 0.1, 10);
  }
  Real("delta (px)", options.delta_px, 0.01, 100);
  Real("depth-break (px)", options.depth_break_px, 0.01, 100);
  Real("mesh-tolerance (px)", options.mesh_tolerance_px, 0, 10);
  Absolute("absolute-delta", options.absolute_delta);
  Absolute("absolute-depth-break", options.absolute_depth_break);
  ImGui::Checkbox("blend linear light", &options.blend_in_linear_light);
  ImGui::Checkbox("fill holes (when still)", &options.fill_holes);
  if (ImGui::Button("defaults")) {
    const int threads = options.threads;
    options = {};
    options.threads = threads;
  }
}

void Figures(const PanelModel& model) {
  const MadePicture& picture = model.picture;
  const PinholeCamera& lens = picture.camera.camera;
  Text(fmt::format("{} x {} px{}", lens.width_px(), lens.height_px(),
                   picture.divisor > 1 ? fmt::format(" (1/{} while moving)", picture.divisor)
                   : picture.whole     ? ""
                                       : " (views are being read)"));
  Text(fmt::format("views {:.1f} ms   draw {:.1f} ms", picture.ms.views, picture.ms.draw));
  Text(fmt::format("inspect {:.1f} ms   window {:.1f} ms", picture.ms.inspect, model.window_ms));
  Text(model.frames_per_second > 0
           ? fmt::format("{:.1f} frames per second while moving", model.frames_per_second)
           : std::string("still"));
  std::string names;
  for (const int index : picture.views_used) {
    names += (names.empty() ? "" : ", ") + picture.scene.views[static_cast<size_t>(index)]->name;
  }
  if (picture.divisor == 1)
    Text(fmt::format("seen by some view: {:.1f} %", 100 * picture.coverage));
  ImGui::TextWrapped("%s", fmt::format("drawn from {}: {}", picture.views_used.size(),
                                       names.empty() ? "no view is valid here" : names)
                               .c_str());
}

void WhereControls(PanelModel& model) {
  Controller& controller = model.controller;
  const auto& views = controller.surroundings().views;
  const auto at = controller.at_view(), nearest = controller.nearest_view();
  if (at) {
    Text("at " + views[*at]->name);
  } else if (nearest) {
    Text("nearest: " + views[*nearest]->name);
  }
  if (ImGui::ArrowButton("##previous", ImGuiDir_Left)) {
    model.pressed.push_back(Action::kPreviousView);
  }
  ImGui::SameLine();
  if (ImGui::ArrowButton("##next", ImGuiDir_Right)) model.pressed.push_back(Action::kNextView);
  ImGui::SameLine();
  if (ImGui::Button("nearest")) model.pressed.push_back(Action::kNearestView);
  ImGui::SameLine();
  if (ImGui::Button("view all")) model.pressed.push_back(Action::kShowAll);
  double speed = controller.fly_speed();
  Real("speed per s", speed, 1e-4 * controller.scene_size(), 100 * controller.scene_size());
  if (speed != controller.fly_speed()) controller.set_fly_speed(speed);
}

void InspectControls(PanelModel& model) {
  Inspection& inspection = model.inspection;
  ImGui::Checkbox("cameras", &inspection.cameras);
  ImGui::SameLine();
  ImGui::Checkbox("magnifier", &inspection.magnifier);
  Choice("compare with", inspection.compared, kAllCompared);
  if (inspection.compared != Compared::kNothing) {
    ImGui::SliderFloat("border", &inspection.border, 0, 1, "%.2f", ImGuiSliderFlags_AlwaysClamp);
  }
  const std::string distance = inspection.DistanceText();
  Text(distance.empty() ? "M marks points to measure between" : "distance " + distance);
  if (!ImGui::TreeNode("views to draw from")) return;
  for (const View* view : model.controller.surroundings().views) {
    bool on = !inspection.IsHidden(*view);
    if (ImGui::Checkbox(view->name.c_str(), &on)) inspection.Toggle(*view);
  }
  if (ImGui::Button("all")) inspection.hidden.clear();
  ImGui::TreePop();
}

void PathControls(PanelModel& model) {
  Flight& flight = model.flight;
  const int frames = flight.keys().empty()
                         ? 0
                         : static_cast<int>(flight.keys().size() - 1) * flight.frames_per_key + 1;
  Text(fmt::format("{} cameras, {} frames", flight.keys().size(), frames));
  Whole("frames per camera", flight.frames_per_key, 1, Flight::kMostFramesPerKey);
  if (ImGui::Button("add camera")) model.pressed.push_back(Action::kAddKey);
  ImGui::SameLine();
  if (ImGui::Button("load...")) model.pressed.push_back(Action::kOpenPath);
  if (ImGui::Button(flight.flying() ? "stop" : "fly")) model.pressed.push_back(Action::kFlyPath);
  ImGui::SameLine();
  if (ImGui::Button(model.recording.empty() ? "record MP4" : "stop recording")) {
    model.pressed.push_back(Action::kRecord);
  }
  if (!model.recording.empty()) Text(model.recording);
}

}  // namespace

void DrawPanel(UserInterface& interface, PanelModel& model) {
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({kMargin, kMargin}, ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowSize({kPanelWidth, display.y - 2 * kMargin}, ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowBgAlpha(0.85F);
  if (ImGui::Begin("D+TR (Tab hides, ? helps)", nullptr, ImGuiWindowFlags_NoSavedSettings)) {
    ImGui::PushItemWidth(kItemWidth);
    Figures(model);
    ImGui::Separator();
    Choice("shown", model.shown, kAllShown);
    ImGui::TextWrapped("%s", LegendOf(model.shown));
    if (ImGui::CollapsingHeader("Inspect", ImGuiTreeNodeFlags_DefaultOpen)) InspectControls(model);
    if (ImGui::CollapsingHeader("Where", ImGuiTreeNodeFlags_DefaultOpen)) WhereControls(model);
    if (ImGui::CollapsingHeader("Render options", ImGuiTreeNodeFlags_DefaultOpen)) {
      RenderControls(model.options);
    }
    if (ImGui::CollapsingHeader("Path", ImGuiTreeNodeFlags_DefaultOpen)) PathControls(model);
    if (ImGui::CollapsingHeader("Keep", ImGuiTreeNodeFlags_DefaultOpen)) {
      if (ImGui::Button("copy command line")) model.pressed.push_back(Action::kCopyCommand);
      if (ImGui::Button("save picture")) model.pressed.push_back(Action::kSavePicture);
      ImGui::SameLine();
      if (ImGui::Button("save window")) model.pressed.push_back(Action::kSaveWindow);
    }
    ImGui::PopItemWidth();
  }
  interface.ThisPanelIsOurs();
  ImGui::End();
}

void DrawHelp(UserInterface& interface, bool& open) {
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({0.5F * display.x, 0.5F * display.y}, ImGuiCond_Always, {0.5F, 0.5F});
  constexpr auto kFlags = ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_AlwaysAutoResize |
                          ImGuiWindowFlags_NoCollapse;
  if (ImGui::Begin("Help", &open, kFlags) &&
      ImGui::BeginTable("keys", 2, ImGuiTableFlags_SizingFixedFit)) {
    for (const HelpLine& line : HelpLines()) {
      ImGui::TableNextColumn();
      ImGui::TextUnformatted(line.keys);
      ImGui::TableNextColumn();
      ImGui::TextUnformatted(line.what);
    }
    ImGui::EndTable();
  }
  interface.ThisPanelIsOurs();
  ImGui::End();
}

void DrawMessage(UserInterface& interface, const std::string& message) {
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({display.x - kMargin, display.y - kMargin}, ImGuiCond_Always, {1, 1});
  ImGui::SetNextWindowSizeConstraints({0, 0}, {0.7F * display.x, 0.5F * display.y});
  ImGui::SetNextWindowBgAlpha(0.85F);
  constexpr auto kFlags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize |
                          ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing;
  if (ImGui::Begin("message", nullptr, kFlags)) {
    ImGui::PushTextWrapPos(0.68F * display.x);
    ImGui::TextUnformatted(message.c_str());
    ImGui::PopTextWrapPos();
  }
  interface.ThisPanelIsOurs();
  ImGui::End();
}

}  // namespace dtr::viewer
