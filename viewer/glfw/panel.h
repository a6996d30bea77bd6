// viewer/glfw/panel.h -- the panel and the help window.
#pragma once
#include <string>
#include <vector>

#include "viewer/controller.h"
#include "viewer/flight.h"
#include "viewer/glfw/frame_maker.h"
#include "viewer/glfw/inspection.h"
#include "viewer/glfw/keys.h"
#include "viewer/glfw/user_interface.h"
#include "viewer/time_player.h"

namespace dtr::viewer {

/// Of a dynamic set.
struct TimeModel {
  int time_steps = 1, time_step = 0;
  double seconds = 0;  ///< since the first time step
  TimePlayer& player;
};

/// What the panel shows and changes.
struct PanelModel {
  const MadeFrame& picture;
  Controller& controller;
  RenderOptions& options;
  const RenderOptions& defaults;  ///< the set's own
  Shown& shown;
  Inspection& inspection;
  const ViewColours& colours;
  Flight& flight;
  TimeModel time;
  std::string recording;  ///< how far a video is; empty: none
  const std::string& message;
  double window_ms = 0;          ///< of the window itself: panels, copying, waiting for the display
  double frames_per_second = 0;  ///< of moving frames; 0: none of late
  std::vector<Action> pressed;   ///< buttons of the panel
  std::vector<ControlPlace> controls;  ///< where they are
};

void DrawPanel(UserInterface& interface, PanelModel& model);
void DrawHelp(UserInterface& interface, bool& open);
/// The palette with the numbers at its ends, at the foot of the window.
void DrawScale(UserInterface& interface, const Scale& scale, const std::string& length_unit);
/// One line at the foot of the window.
void DrawMessage(UserInterface& interface, const std::string& message);

}  // namespace dtr::viewer
