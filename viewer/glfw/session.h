// viewer/glfw/session.h -- a set in the window, with all that points into it.
#pragma once
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dtr/render/time_steps.h"
#include "viewer/controller.h"
#include "viewer/glfw/app.h"
#include "viewer/glfw/frame_maker.h"
#include "viewer/glfw/frame_schedule.h"
#include "viewer/glfw/inspector.h"
#include "viewer/sigma_cache.h"

namespace dtr::viewer {

/// Replaced as a whole when the set is read again. Belongs to the current context, as gl::Renderer.
class Session {
 public:
  using Tell = std::function<void(const std::string&)>;
  /// Opens the set; throws dtr::Error where it cannot. The settings and the host outlive it. Sizes
  /// of the window in pixels.
  Session(const AppSettings& settings, const Host& host, const Tell& tell, int width_px,
          int height_px);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Goes on where another set was left, by what both call the same: the camera's place in the
  /// world, views by their names. Returns what is to be added to points of this stored world to get
  /// the other's: this origin less the other's.
  Eigen::Vector3d ContinueFrom(const Session& before);

  const OpenedSet& opened() const { return *opened_; }

  /// Of a dynamic set: the frame that is shown. What is left out of one is left out of all, by
  /// name.
  size_t time_step() const { return time_step_; }
  void ShowTimeStep(size_t time_step);
  const FrameClock& clock() const { return clock_; }

  /// A camera on the line from home to one that has the whole foreground in its image, as far as
  /// halving finds 90 % of the coverage at home.
  NovelCamera Overview(FrameRequest request);

  /// Tries views again that could not be read and whose files have changed since, or came back.
  void RetryLostViews();
  /// What the shown image shows there, as plane z of the present camera.
  std::optional<double> DepthAt(const Eigen::Vector2d& pixel);
  /// Also of views that this time step lacks.
  std::vector<std::string> HiddenNames() const;
  /// The views of that time step that are called so.
  std::vector<const View*> HiddenAt(size_t time_step) const;
  /// Writes down what of the window's state is the set's: camera, image, inspection, time step.
  void Describe(AppState& state) const;

 private:
  void Hide(const std::vector<std::string>& names);
  const Grid<float>* SigmaOfView(const View& view);

  const Host& host_;
  const std::unique_ptr<OpenedSet> opened_;
  const FrameClock clock_;
  size_t time_step_ = 0;
  std::map<const View*, std::string> tried_views_, tried_photos_;  ///< stamps of lost ones' files
  SigmaCache sigmas_;
  std::vector<std::string> hidden_elsewhere_;  ///< names that this time step lacks

 public:
  FrameMaker maker;
  FrameSchedule schedule;
  Controller controller;
  Inspector inspector;
};

}  // namespace dtr::viewer
