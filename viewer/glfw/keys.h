// viewer/glfw/keys.h -- one table of keys: what they do, and what the help says of them.
#pragma once
#include <optional>
#include <span>

#include "viewer/input.h"

namespace dtr::viewer {

enum class Action {
  kNextView,
  kPreviousView,
  kNearestView,
  kShowAll,
  kHome,
  kHelp,
  kPanel,
  kSaveImage,
  kSaveWindow,
  kCopyCommand,
  kCameras,
  kMagnifier,
  kCompare,
  kHideView,
  kMark,
  kAddKey,
  kOpenPath,
  kFlyPath,
  kRecord,
  kNextTimeStep,
  kPreviousTimeStep,
  kPlayTime,
  kSlower,
  kFaster,
  kNextShown,
  kPreviousShown,
  kQuit,
};

struct HelpLine {
  const char* keys;
  const char* what;
};

/// What the help window lists, in its order.
std::span<const HelpLine> HelpLines();

/// By GLFW key and modifiers: keys are named by their place on an American keyboard.
std::optional<Action> ActionOf(int glfw_key, int glfw_mods);
std::optional<FlyKey> FlyKeyOf(int glfw_key);

}  // namespace dtr::viewer
