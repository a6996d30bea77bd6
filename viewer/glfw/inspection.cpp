#include "viewer/glfw/inspection.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "dtr/render/option_names.h"
#include "viewer/overlay.h"

namespace dtr::viewer {
namespace {

constexpr ImU32 kGround = IM_COL32(28, 30, 33, 255), kLine = IM_COL32(255, 255, 255, 220);
constexpr ImU32 kGood = IM_COL32(90, 220, 120, 255), kBad = IM_COL32(255, 80, 70, 255);
constexpr ImU32 kUntested = IM_COL32(120, 170, 255, 255), kOff = IM_COL32(130, 130, 130, 255);
constexpr ImU32 kHeldOut = IM_COL32(255, 150, 240, 255);
constexpr ImU32 kMark = IM_COL32(255, 225, 60, 255);
constexpr double kFrustumShare = 0.06;  // of the scene's size: length of a drawn camera
constexpr int kMagnifiedPx = 25, kMagnification = 8;

ImTextureID IdOf(const FrameTexture& texture) {
  return reinterpret_cast<ImTextureID>(static_cast<std::intptr_t>(texture.name()));
}

/// On the display; none behind the camera.
std::optional<ImVec2> Project(const NovelCamera& camera, const Eigen::Vector3d& p_in_world) {
  constexpr double kFar = 1e5;  // beyond it, single precision draws nonsense
  const auto pixel = camera.camera.PixelFromCam(camera.cam_from_world * p_in_world);
  if (!pixel || !(pixel->cwiseAbs().maxCoeff() < kFar)) return std::nullopt;
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  return ImVec2(static_cast<float>(pixel->x() * display.x / camera.camera.width_px()),
                static_cast<float>(pixel->y() * display.y / camera.camera.height_px()));
}

void CoverRight(ImDrawList& list, float border) {
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  list.PushClipRect({border * display.x, 0}, display);
  list.AddRectFilled({0, 0}, display, kGround);
}

void EndRight(ImDrawList& list, float border) {
  list.PopClipRect();
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  list.AddLine({border * display.x, 0}, {border * display.x, display.y}, kLine, 2);
}

/// A line of text that can be read on any image.
void Label(ImDrawList& list, const ImVec2& at, ImU32 colour, const std::string& text) {
  const ImVec2 size = ImGui::CalcTextSize(text.c_str());
  list.AddRectFilled({at.x - 4, at.y - 2}, {at.x + size.x + 4, at.y + size.y + 2}, kGround);
  list.AddText(at, colour, text.c_str());
}

std::string Described(const RenderOptions& options) {
  if (options.method == RenderMethod::kDeferred) return NameOf(options.method);
  return fmt::format("{}, {}", NameOf(options.method), NameOf(options.primitive));
}

void Text(const std::string& line) { ImGui::TextUnformatted(line.c_str()); }

/// A camera as it is drawn; none of a point behind the one who looks.
struct Frustum {
  std::optional<ImVec2> centre;
  std::array<std::optional<ImVec2>, 4> corners;  ///< of the image: from the top left, clockwise
};

Frustum FrustumOf(const View& view, const NovelCamera& seen_from, double length) {
  const Pose world_from_cam = view.cam_from_world.Inverse();
  const double w = view.camera.width_px(), h = view.camera.height_px();
  const Eigen::Vector2d pixels[4] = {{0, 0}, {w, 0}, {w, h}, {0, h}};
  Frustum frustum{Project(seen_from, world_from_cam.translation), {}};
  for (size_t i = 0; i < 4; ++i) {
    frustum.corners[i] =
        Project(seen_from, world_from_cam * (length * view.camera.RayFromPixel(pixels[i])));
  }
  return frustum;
}

bool HidesLittle(const std::array<std::optional<ImVec2>, 4>& corners) {
  std::array<Eigen::Vector2d, 4> places;
  for (size_t i = 0; i < 4; ++i) {
    if (!corners[i]) return false;
    places[i] = {corners[i]->x, corners[i]->y};
  }
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  return MayBeLaidOver(places, {display.x, display.y});
}

/// `photo` may be null.
void DrawFrustum(ImDrawList& list, const Frustum& frustum, ImU32 colour,
                 const FrameTexture* photo) {
  const auto& corners = frustum.corners;
  if (photo != nullptr && HidesLittle(corners)) {
    list.AddImageQuad(IdOf(*photo), *corners[0], *corners[1], *corners[2], *corners[3], {0, 0},
                      {1, 0}, {1, 1}, {0, 1}, IM_COL32(255, 255, 255, 200));
  }
  for (size_t i = 0; i < 4; ++i) {
    if (frustum.centre && corners[i]) list.AddLine(*frustum.centre, *corners[i], colour, 1.5F);
    const auto& next = corners[(i + 1) % 4];
    if (corners[i] && next) list.AddLine(*corners[i], *next, colour, 1.5F);
  }
}

/// What is written beside a camera, and in which colour.
struct CameraName {
  ImU32 colour;
  std::string text;
};

}  // namespace

const char* NameOf(Compared compared) {
  switch (compared) {
    case Compared::kNothing:
      return "nothing";
    case Compared::kPhoto:
      return "nearest photo";
    case Compared::kOtherMethod:
      return "other method";
    case Compared::kOtherPrimitive:
      return "other primitive";
  }
  return "";
}

std::string WhatACommandLeavesOut(Shown shown, Compared compared) {
  std::string line;
  if (shown == Shown::kDepth || shown == Shown::kCoverage) {
    line = fmt::format("\n(colours, and beside them the {}; its false colours are the window's: P)",
                       NameOf(shown));
  } else if (shown != Shown::kColour) {
    line = fmt::format("\n(colours: {} is the window's own, P saves it)", NameOf(shown));
  }
  if (compared != Compared::kNothing) {
    line += fmt::format("\n(what lies left of the border: the {} is not in it)", NameOf(compared));
  }
  return line;
}

std::optional<RenderOptions> OptionsOf(Compared compared, const RenderOptions& options) {
  RenderOptions other = options;
  if (compared == Compared::kOtherMethod) {
    other.method = options.method == RenderMethod::kDeferred ? RenderMethod::kTwoPass
                                                             : RenderMethod::kDeferred;
    other.primitive = Primitive::kMesh;
    return other;
  }
  if (compared == Compared::kOtherPrimitive) {
    const bool splats =
        options.method == RenderMethod::kTwoPass && options.primitive == Primitive::kSplat;
    other.method = RenderMethod::kTwoPass;
    other.primitive = splats ? Primitive::kMesh : Primitive::kSplat;
    return other;
  }
  return std::nullopt;
}

bool Inspection::IsHidden(const View& view) const {
  return std::find(hidden.begin(), hidden.end(), &view) != hidden.end();
}

void Inspection::Toggle(const View& view) {
  if (std::erase(hidden, &view) == 0) hidden.push_back(&view);
}

void Inspection::Mark(const Probe& probe) {
  if (marks.size() >= 2) marks.clear();
  marks.push_back(probe);
}

std::string Inspection::DistanceText() const {
  if (marks.size() < 2) return "";
  const Distance distance = DistanceBetween(marks[0], marks[1]);
  return fmt::format("{:.5g}{} {}", distance.length,
                     distance.sigma ? fmt::format(" +- {:.2g}", *distance.sigma) : " (no sigma)",
                     unit);
}

void InspectionOverlay::DrawCompared(const Inspection& inspection, const FrameTexture& other,
                                     const RenderOptions& left, const RenderOptions& right) {
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  CoverRight(list, inspection.border);
  list.AddImage(IdOf(other), {0, 0}, display);
  EndRight(list, inspection.border);
  const std::string names[] = {Described(left), Described(right)};
  const float at = inspection.border * display.x;
  const float x[] = {at - ImGui::CalcTextSize(names[0].c_str()).x - 10, at + 10};
  for (size_t side = 0; side < 2; ++side) Label(list, {x[side], 8}, kLine, names[side]);
}

void InspectionOverlay::DrawPhoto(const Inspection& inspection, const View& view,
                                  const NovelCamera& camera, PhotoCache& photos) {
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  CoverRight(list, inspection.border);
  std::string label = view.name + (view.role == ViewRole::kHeldOut ? " (held out)" : "");
  if (photo_of_ != &view) {
    const ImageRgb8* photo = view.image.empty() ? photos.Whole(view) : &view.image;
    if (photo != nullptr) {
      photo_.Upload(*photo);
      photo_of_ = &view;
    } else if (const std::string* rejection = photos.RejectionOf(view)) {
      label += ": photo not read: " + *rejection;
    } else {
      label += ": photo is being read";
    }
  }
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  if (photo_of_ == &view) {
    const PinholeCamera &to = camera.camera, &from = view.camera;
    const auto place = [&](double u, double v) {
      const double x = to.cx_px() + (u - from.cx_px()) * to.fx_px() / from.fx_px();
      const double y = to.cy_px() + (v - from.cy_px()) * to.fy_px() / from.fy_px();
      return ImVec2(static_cast<float>(x * display.x / to.width_px()),
                    static_cast<float>(y * display.y / to.height_px()));
    };
    list.AddImage(IdOf(photo_), place(0, 0), place(from.width_px(), from.height_px()));
  }
  EndRight(list, inspection.border);
  Label(list, {inspection.border * display.x + 10, 8}, kLine, label);
}

const FrameTexture* InspectionOverlay::Thumbnail(const View& view, FrameMaker& maker,
                                                 PhotoCache& photos) {
  auto thumbnail = thumbnails_.find(&view);
  if (thumbnail == thumbnails_.end()) {
    const ImageRgb8* small = maker.ThumbnailOf(view);
    if (small == nullptr) small = photos.Small(view);
    if (small == nullptr) return nullptr;
    thumbnail = thumbnails_.emplace(&view, std::make_unique<FrameTexture>()).first;
    thumbnail->second->Upload(*small);
  }
  return thumbnail->second.get();
}

void InspectionOverlay::DrawCameras(const Controller& controller, const Inspection& inspection,
                                    const std::map<std::string, ViewValidation>& validations,
                                    FrameMaker& maker, PhotoCache& photos) {
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  const NovelCamera& camera = controller.camera();
  const double length = kFrustumShare * controller.scene_size();
  thumbnails_shown_ = 0;
  std::vector<CameraName> names;
  std::vector<PlacedName> places;
  for (const View* view : controller.surroundings().cameras) {
    const auto validation = validations.find(view->name);
    const bool held_out = view->role == ViewRole::kHeldOut;
    const ImU32 colour = held_out                          ? kHeldOut
                         : inspection.IsHidden(*view)      ? kOff
                         : validation == validations.end() ? kUntested
                         : validation->second.good         ? kGood
                                                           : kBad;
    const FrameTexture* photo = Thumbnail(*view, maker, photos);
    thumbnails_shown_ += photo != nullptr;
    const Frustum frustum = FrustumOf(*view, camera, length);
    DrawFrustum(list, frustum, colour, photo);
    const auto& at = frustum.corners[3];
    if (!at) continue;
    names.push_back(
        {colour, view->name + (held_out ? " (held out)" : "") +
                     (validation == validations.end() ? "" : " " + validation->second.text)});
    const ImVec2 size = ImGui::CalcTextSize(names.back().text.c_str());
    places.push_back(
        {(camera.cam_from_world * view->CenterInWorld()).norm(),
         {Eigen::Vector2d(at->x, at->y), Eigen::Vector2d(at->x + size.x, at->y + size.y)}});
  }
  for (const size_t i : LegibleNames(places)) {
    const Eigen::Vector2f at = places[i].box.min().cast<float>();
    list.AddText({at.x(), at.y()}, names[i].colour, names[i].text.c_str());
  }
}

void InspectionOverlay::DrawMarks(const Inspection& inspection, const NovelCamera& camera) {
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  std::vector<ImVec2> at;
  for (const Probe& mark : inspection.marks) {
    const auto on_display = Project(camera, mark.p_in_world);
    if (!on_display) continue;
    at.push_back(*on_display);
    list.AddCircle(*on_display, 6, kMark, 0, 2);
  }
  if (at.size() < 2) return;
  list.AddLine(at[0], at[1], kMark, 2);
  const ImVec2 middle(0.5F * (at[0].x + at[1].x) + 8, 0.5F * (at[0].y + at[1].y));
  Label(list, middle, kMark, inspection.DistanceText());
}

void InspectionOverlay::DrawMagnifier(const Inspection& inspection, const FrameTexture& picture) {
  const ImVec2 display = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({display.x - 8, 8}, ImGuiCond_Always, {1, 0});
  ImGui::SetNextWindowBgAlpha(0.9F);
  constexpr auto kFlags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize |
                          ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoInputs |
                          ImGuiWindowFlags_NoFocusOnAppearing;
  if (ImGui::Begin("magnifier", nullptr, kFlags)) {
    const ImVec2 at = ImGui::GetMousePos();
    const float half = 0.5F * kMagnifiedPx, side = kMagnifiedPx * kMagnification;
    if (!picture.empty()) {
      ImGui::Image(IdOf(picture), {side, side},
                   {(at.x - half) / display.x, (at.y - half) / display.y},
                   {(at.x + half) / display.x, (at.y + half) / display.y});
    }
    if (inspection.under_cursor) {
      const Probe& probe = *inspection.under_cursor;
      const Eigen::Vector3d& p = probe.p_in_world;
      Text(fmt::format("depth {:.5g}{} {}", probe.depth_z,
                       probe.sigma_z ? fmt::format(" +- {:.2g}", *probe.sigma_z) : "",
                       inspection.unit));
      Text(fmt::format("world {:.5g}, {:.5g}, {:.5g}", p.x(), p.y(), p.z()));
      for (const ProbeView& view : probe.views) {
        Text(fmt::format("{:5.1f} %  {}  z {:.5g}{}  {:+.2f} px", 100 * view.share, view.name,
                         view.depth_z, view.sigma_z ? fmt::format(" +- {:.2g}", *view.sigma_z) : "",
                         view.behind_px));
      }
    } else {
      Text("no view sees this pixel, or the image moves");
    }
  }
  ImGui::End();
}

}  // namespace dtr::viewer
