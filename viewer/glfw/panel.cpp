#include "viewer/glfw/panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include "dtr/report/false_color.h"
#include "viewer/glfw/widgets.h"

namespace dtr::viewer {
namespace {

constexpr float kPanelWidth = 330, kMargin = 8, kItemWidth = 150;

void PanelText(const std::string& line) { ImGui::TextUnformatted(line.c_str()); }

/// As many names on a line as fit: ImGui's own wrapping would break them at their dots. A name
/// wider than the panel is wrapped all the same.
void WrappedNames(std::string line, const std::vector<std::string>& names) {
  const float room = ImGui::GetContentRegionAvail().x;
  for (size_t i = 0; i < names.size(); ++i) {
    const std::string name = names[i] + (i + 1 < names.size() ? "," : "");
    if (ImGui::CalcTextSize((line + " " + name).c_str()).x <= room) {
      line += " " + name;
      continue;
    }
    ImGui::TextWrapped("%s", line.c_str());
    line = name;
  }
  ImGui::TextWrapped("%s", line.c_str());
}

void RenderControls(Widgets& widgets, RenderOptions& options, const RenderOptions& defaults) {
  widgets.Choice("method", options.method, kRenderMethods);
  const Primitive before = options.primitive;
  widgets.Choice("primitive", options.primitive, kPrimitives);
  // As on the command line: asking for splats picks the method that has them.
  if (options.primitive != before && options.primitive == Primitive::kSplat) {
    options.method = RenderMethod::kTwoPass;
  }
  widgets.Whole("views", options.views, 1, 64);
  widgets.Whole("resolution", options.resolution, 1, 64);
  widgets.Choice("blend", options.blend, kBlendWeights);
  if (options.blend == BlendWeight::kCosine) widgets.Real("exponent", options.exponent, 0, 1000);
  if (options.blend == BlendWeight::kExponential) widgets.Real("falloff", options.falloff, 0, 1000);
  if (options.blend == BlendWeight::kInverseAngle || options.blend == BlendWeight::kKNearest) {
    widgets.Whole("blend-k", options.blend_k, 1, 64);
  }
  widgets.Degrees("max-angle", options.max_angle_rad, 1, 180);
  if (options.primitive == Primitive::kSplat) {
    widgets.Real("point-size", options.point_size, 0.1, 10);
  }
  widgets.Real("delta (px)", options.delta_px, 0.01, 100);
  widgets.Real("depth-break (px)", options.depth_break_px, 0.01, 100);
  widgets.Real("mesh-tolerance (px)", options.mesh_tolerance_px, 0, 10);
  widgets.Absolute("absolute-delta", options.absolute_delta);
  widgets.Absolute("absolute-depth-break", options.absolute_depth_break);
  widgets.Check("blend linear light", options.blend_in_linear_light);
  widgets.Check("fill holes", options.fill_holes);
  widgets.Check("smooth edges", options.smooth_edges);
  if (widgets.Button("defaults")) {
    options = defaults;
  }
}

void Figures(const PanelModel& model) {
  const MadeFrame& picture = model.picture;
  const PinholeCamera& lens = picture.camera.camera;
  PanelText(fmt::format("{} x {} px{}", lens.width_px(), lens.height_px(),
                        picture.divisor > 1 ? fmt::format(" (1/{} while moving)", picture.divisor)
                        : picture.whole     ? ""
                                            : " (views are being read)"));
  PanelText(fmt::format("views {:.1f} ms   draw {:.1f} ms", picture.ms.views, picture.ms.draw));
  PanelText(
      fmt::format("inspect {:.1f} ms   window {:.1f} ms", picture.ms.inspect, model.window_ms));
  PanelText(model.frames_per_second > 0
                ? fmt::format("{:.1f} frames per second while moving", model.frames_per_second)
                : std::string("still"));
  // One line always, so that what stands below keeps its place while one clicks.
  PanelText(picture.divisor == 1
                ? fmt::format("seen by some view: {:.1f} %", 100 * picture.coverage)
                : std::string("seen by some view: shown when still"));
  std::vector<std::string> names;
  for (const int index : picture.views_used) {
    names.push_back(picture.scene.views[static_cast<size_t>(index)]->name);
  }
  if (names.empty()) {
    names.push_back(picture.whole ? "no view is valid here" : "views are being read");
  }
  WrappedNames(fmt::format("drawn from {}:", picture.views_used.size()), names);
}

void WhereControls(Widgets& widgets, PanelModel& model) {
  Controller& controller = model.controller;
  const auto& cameras = controller.surroundings().cameras;
  const auto at = controller.at_view(), nearest = controller.nearest_view();
  if (const auto which = at ? at : nearest) {
    const View& view = *cameras[*which];
    PanelText((at ? "at " : "nearest: ") + view.name +
              (view.role == ViewRole::kHeldOut ? " (held out)" : ""));
  }
  if (widgets.Arrow("previous", ImGuiDir_Left)) model.pressed.push_back(Action::kPreviousView);
  ImGui::SameLine();
  if (widgets.Arrow("next", ImGuiDir_Right)) model.pressed.push_back(Action::kNextView);
  ImGui::SameLine();
  if (widgets.Button("nearest")) model.pressed.push_back(Action::kNearestView);
  ImGui::SameLine();
  if (widgets.Button("home")) model.pressed.push_back(Action::kHome);
  ImGui::SameLine();
  if (widgets.Button("view all")) model.pressed.push_back(Action::kShowAll);
  double speed = controller.fly_speed();
  widgets.Real("speed per s", speed, 1e-4 * controller.scene_size(), 100 * controller.scene_size());
  if (speed != controller.fly_speed()) controller.set_fly_speed(speed);
}

void InspectControls(Widgets& widgets, PanelModel& model) {
  Inspection& inspection = model.inspection;
  widgets.Check("cameras", inspection.cameras);
  ImGui::SameLine();
  widgets.Check("magnifier", inspection.magnifier);
  widgets.Choice("compare with", inspection.compared, kAllCompared);
  if (inspection.compared != Compared::kNothing) {
    widgets.Share("border", inspection.border);
  }
  const std::string distance = inspection.DistanceText();
  PanelText(distance.empty() ? "M marks points to measure between" : "distance " + distance);
  if (!widgets.Tree("views to draw from")) return;
  for (const View* view : model.controller.surroundings().views) {
    // The view's colour among weights and wireframes.
    const Rgb colour = model.colours.Of(*view);
    const float side = ImGui::GetFrameHeight();
    ImGui::ColorButton(("##colour of " + view->name).c_str(),
                       ImVec4(colour[0] / 255.0F, colour[1] / 255.0F, colour[2] / 255.0F, 1),
                       ImGuiColorEditFlags_NoTooltip | ImGuiColorEditFlags_NoDragDrop,
                       {0.6F * side, side});
    ImGui::SameLine();
    bool on = !inspection.IsHidden(*view);
    const bool was_on = on;
    widgets.Check(("view " + view->name).c_str(), view->name.c_str(), on);
    if (on != was_on) inspection.Toggle(*view);
  }
  if (widgets.Button("all")) inspection.hidden.clear();
  ImGui::TreePop();
}

void TimeControls(Widgets& widgets, PanelModel& model) {
  TimeModel& time = model.time;
  PanelText(fmt::format("{:.3f} s, time step {} of {}", time.seconds, time.time_step + 1,
                        time.time_steps));
  widgets.Whole("time step", time.time_step, 0, time.time_steps - 1, false);
  if (widgets.Arrow("earlier", ImGuiDir_Left)) model.pressed.push_back(Action::kPreviousTimeStep);
  ImGui::SameLine();
  if (widgets.Arrow("later", ImGuiDir_Right)) model.pressed.push_back(Action::kNextTimeStep);
  ImGui::SameLine();
  if (widgets.Button("play", time.player.playing() ? "stand still" : "play")) {
    model.pressed.push_back(Action::kPlayTime);
  }
  ImGui::SameLine();
  widgets.Check("loop", "loop", time.player.loop);
  widgets.Real("speed", time.player.speed, TimePlayer::kMinSpeed, TimePlayer::kMaxSpeed);
}

void PathControls(Widgets& widgets, PanelModel& model) {
  Flight& flight = model.flight;
  const int frames = flight.keys().empty()
                         ? 0
                         : static_cast<int>(flight.keys().size() - 1) * flight.frames_per_key + 1;
  PanelText(fmt::format("{} cameras, {} frames", flight.keys().size(), frames));
  widgets.Whole("frames per camera", flight.frames_per_key, 1, Flight::kMaxFramesPerKey);
  if (widgets.Button("add camera")) model.pressed.push_back(Action::kAddKey);
  ImGui::SameLine();
  if (widgets.Button("load...")) model.pressed.push_back(Action::kOpenPath);
  if (widgets.Button("fly", flight.flying() ? "stop" : "fly"))
    model.pressed.push_back(Action::kFlyPath);
  ImGui::SameLine();
  if (widgets.Button("record", model.recording.empty() ? "record MP4" : "stop recording")) {
    model.pressed.push_back(Action::kRecord);
  }
  if (!model.recording.empty()) PanelText(model.recording);
}

void KeepControls(Widgets& widgets, PanelModel& model) {
  if (widgets.Button("copy command line")) model.pressed.push_back(Action::kCopyCommand);
  if (widgets.Button("save image")) model.pressed.push_back(Action::kSaveImage);
  ImGui::SameLine();
  if (widgets.Button("save window")) model.pressed.push_back(Action::kSaveWindow);
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
    Widgets widgets(model.controls);
    widgets.Choice("shown", model.shown, kAllShown);
    ImGui::TextWrapped("%s", LegendOf(model.shown));
    if (widgets.Header("Inspect")) InspectControls(widgets, model);
    if (widgets.Header("Where")) WhereControls(widgets, model);
    if (model.time.time_steps > 1 && widgets.Header("Time")) TimeControls(widgets, model);
    if (widgets.Header("Render options")) {
      RenderControls(widgets, model.options, model.defaults);
    }
    if (widgets.Header("Path")) PathControls(widgets, model);
    if (widgets.Header("Keep")) KeepControls(widgets, model);
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

void DrawScale(UserInterface& interface, const Scale& scale, const std::string& length_unit) {
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({0.5F * display.x, display.y - kMargin}, ImGuiCond_Always, {0.5F, 1});
  ImGui::SetNextWindowBgAlpha(0.85F);
  constexpr auto kFlags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize |
                          ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing;
  if (ImGui::Begin("scale", nullptr, kFlags)) {
    constexpr int kSteps = 64;
    constexpr float kStepPx = 4;
    PanelText(TextOf(scale.dark, scale.unit, length_unit));
    ImGui::SameLine();
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    const float height = ImGui::GetTextLineHeight();
    for (int step = 0; step < kSteps; ++step) {
      const Rgb colour = report::PaletteColor(report::Palette::kColor, step / (kSteps - 1.0));
      const float left = corner.x + kStepPx * static_cast<float>(step);
      ImGui::GetWindowDrawList()->AddRectFilled({left, corner.y},
                                                {left + kStepPx, corner.y + height},
                                                IM_COL32(colour[0], colour[1], colour[2], 255));
    }
    ImGui::Dummy({kSteps * kStepPx, height});
    ImGui::SameLine();
    PanelText(TextOf(scale.bright, scale.unit, length_unit));
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
