// viewer/glfw/inspector.h -- what is looked up about the whole image, and drawn over it.
#pragma once
#include <functional>
#include <future>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "viewer/controller.h"
#include "viewer/glfw/app.h"
#include "viewer/glfw/frame_maker.h"
#include "viewer/glfw/frame_schedule.h"
#include "viewer/glfw/inspection.h"
#include "viewer/probe.h"

namespace dtr::viewer {

/// Of one set: everything here points to its views.
class Inspector {
 public:
  using Validations = std::map<std::string, ViewValidation>;
  struct Sources {
    FrameMaker& maker;
    const FrameSchedule& schedule;
    const Controller& controller;
    SigmaOf sigma_of;
    std::function<Validations()> validations;  ///< may be null; called on a thread of its own
    std::function<ImageRgb8(const View&)> load_photo;  ///< as Host::load_photo
    std::function<void(const std::string&)> tell;
  };
  explicit Inspector(Sources sources)
      : from_(std::move(sources)), photos_(from_.load_photo, kThumbnailPx) {}

  Inspection& inspection() { return inspection_; }
  const Inspection& inspection() const { return inspection_; }

  /// To be marked on the next whole image.
  void MarkAt(const Eigen::Vector2d& pixel) { to_mark_.push_back(pixel); }
  /// Looks up what is asked for, of a whole image; otherwise forgets what was of another.
  void Look(bool whole, const RenderOptions& options, const Eigen::Vector2d& cursor_px);
  /// Draws it with ImGui.
  void Draw(const RenderOptions& options);
  /// True while photos are being read that are to be shown.
  bool reading() const { return photos_.reading(); }
  /// Photos that could not be read, of views that `again` says yes to.
  void TryPhotosAgain(const std::function<bool(const View&)>& again) {
    photos_.ForgetRejections(again);
  }
  /// The view whose photo is beside the image; null: none.
  const View* photo() const;
  /// Input cameras that are shown with their photo.
  int thumbnails() const { return inspection_.cameras ? overlay_.thumbnails() : 0; }

 private:
  std::optional<Probe> ProbeAt(const Eigen::Vector2d& pixel);
  void AskForValidations();

  const Sources from_;
  Inspection inspection_;
  InspectionOverlay overlay_;
  PhotoCache photos_;
  int picture_ = -1;                         ///< number of the image that what follows is of
  std::optional<RenderOptions> other_made_;  ///< options of the other image beside it
  std::optional<Eigen::Vector2d> probed_;    ///< where the cursor rested
  Eigen::Vector2d last_cursor_{-1, -1};
  Stopwatch cursor_rests_;
  std::vector<Eigen::Vector2d> to_mark_;
  std::future<Validations> validations_coming_;
  Validations validations_;
  bool validations_asked_ = false;
};

}  // namespace dtr::viewer
