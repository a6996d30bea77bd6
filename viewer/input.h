// viewer/input.h -- what a person does to a window, without the window.
#pragma once
#include <variant>

namespace dtr::viewer {

enum class Button { kLeft, kRight, kMiddle };

/// Keys that move the camera while they are held.
enum class FlyKey { kForward, kBack, kLeft, kRight, kUp, kDown };
inline constexpr int kFlyKeys = 6;

struct ButtonEvent {
  Button button = Button::kLeft;
  bool pressed = false;
  double x_px = 0, y_px = 0;  ///< of the image
};
struct MoveEvent {
  double x_px = 0, y_px = 0;
};
struct ScrollEvent {
  double steps = 0;  ///< up is positive
  double x_px = 0, y_px = 0;
};
struct FlyEvent {
  FlyKey key = FlyKey::kForward;
  bool pressed = false;
};
/// The window no longer gets what is released.
struct FocusLostEvent {};

using InputEvent = std::variant<ButtonEvent, MoveEvent, ScrollEvent, FlyEvent, FocusLostEvent>;

}  // namespace dtr::viewer
