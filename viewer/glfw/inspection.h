// viewer/glfw/inspection.h -- what lies over the image: cameras, another image, figures of a
// point.
#pragma once
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viewer/controller.h"
#include "viewer/glfw/app.h"
#include "viewer/glfw/frame_maker.h"
#include "viewer/glfw/photo_cache.h"
#include "viewer/probe.h"
#include "viewer/shown.h"

namespace dtr::viewer {

/// What the right part of the window shows instead. The other primitive: splats beside a mesh, a
/// mesh beside splats (as the founding report compares them), both by two passes.
enum class Compared { kNothing, kPhoto, kOtherMethod, kOtherPrimitive };
inline constexpr std::array kAllCompared{Compared::kNothing, Compared::kPhoto,
                                         Compared::kOtherMethod, Compared::kOtherPrimitive};
const char* NameOf(Compared compared);
/// A line for the end of a command that draws the image in the window: `dtr render` knows
/// colours, depth and coverage. Empty where it draws all of it.
std::string WhatACommandLeavesOut(Shown shown, Compared compared);
/// The options of the other image; none where it is no rendering.
std::optional<RenderOptions> OptionsOf(Compared compared, const RenderOptions& options);

/// What the user asked to see over the image.
struct Inspection {
  bool cameras = false, magnifier = false;
  Compared compared = Compared::kNothing;
  float border = 0.5F;                ///< share of the window left of the other image
  std::vector<const View*> hidden;    ///< not drawn from
  std::vector<Probe> marks;           ///< at most two: a distance
  std::optional<Probe> under_cursor;  ///< of the last cursor at rest
  std::string unit;                   ///< of lengths: "m" or "units"

  /// True while the pixels of the image's views are looked at; photos are read by themselves.
  bool LooksAtPixels() const {
    return magnifier || (compared != Compared::kNothing && compared != Compared::kPhoto);
  }
  bool IsHidden(const View& view) const;
  void Toggle(const View& view);
  /// Adds a mark; a third begins again.
  void Mark(const Probe& probe);
  /// "2.310 +- 0.021 m"; empty without two marks.
  std::string DistanceText() const;
};

/// Draws it with ImGui.
class InspectionOverlay {
 public:
  /// The other image, right of the border, and what each side is drawn by.
  void DrawCompared(const Inspection& inspection, const FrameTexture& other,
                    const RenderOptions& left, const RenderOptions& right);
  /// The photo of `view` where it would lie if this were its camera; as long as there is none,
  /// why.
  void DrawPhoto(const Inspection& inspection, const View& view, const NovelCamera& camera,
                 PhotoCache& photos);
  /// With small photos of the input cameras, those of held-out photos in a colour of their own.
  void DrawCameras(const Controller& controller, const Inspection& inspection,
                   const std::map<std::string, ViewValidation>& validations, FrameMaker& maker,
                   PhotoCache& photos);
  void DrawMarks(const Inspection& inspection, const NovelCamera& camera);
  void DrawMagnifier(const Inspection& inspection, const FrameTexture& picture);
  int thumbnails() const { return thumbnails_shown_; }
  const View* photo_of() const { return photo_of_; }

 private:
  /// Null as long as there is no small photo of it.
  const FrameTexture* Thumbnail(const View& view, FrameMaker& maker, PhotoCache& photos);

  std::map<const View*, std::unique_ptr<FrameTexture>> thumbnails_;
  int thumbnails_shown_ = 0;  ///< of this time step's cameras
  FrameTexture photo_;
  const View* photo_of_ = nullptr;
};

}  // namespace dtr::viewer
