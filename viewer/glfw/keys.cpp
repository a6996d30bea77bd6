#include "viewer/glfw/keys.h"

#include <GLFW/glfw3.h>

#include <array>

namespace dtr::viewer {
namespace {

constexpr std::array kHelp{
    HelpLine{"left drag", "orbit about the point under the cursor"},
    HelpLine{"right drag", "look around"},
    HelpLine{"middle drag", "move across"},
    HelpLine{"wheel", "towards the point under the cursor; while flying: speed"},
    HelpLine{"W A S D", "fly forward, left, back, right"},
    HelpLine{"E Q", "fly up, down"},
    HelpLine{"Right, Left", "next, previous input camera"},
    HelpLine{"C", "nearest input camera"},
    HelpLine{"V", "view all that was photographed"},
    HelpLine{"Home", "back to where the window began"},
    HelpLine{"Down, Up", "show the next, the previous kind of image"},
    HelpLine{"F", "input cameras with their photos and validation results on, off"},
    HelpLine{"G", "magnifying glass: depth, sigma, views and weights under the cursor"},
    HelpLine{"X", "compare: with the nearest photo, the other method, the other primitive"},
    HelpLine{"H", "leave the nearest view out, take it in again"},
    HelpLine{"M", "mark the point under the cursor; two marks: their distance"},
    HelpLine{"T", "play a dynamic set, stop"},
    HelpLine{", .", "a dynamic set at half, at twice the speed"},
    HelpLine{"N, B", "next, previous time step of a dynamic set"},
    HelpLine{"K", "add this camera to the path"},
    HelpLine{"O", "load a path file; or drop one onto the window"},
    HelpLine{"Space", "fly along the path, stop; without a path: as T"},
    HelpLine{"R", "record the path as MP4, stop"},
    HelpLine{"P", "save the image"},
    HelpLine{"F12", "save the window"},
    HelpLine{"L", "command line of this image, to the clipboard and the terminal"},
    HelpLine{"Tab", "panel on, off"},
    HelpLine{"? or F1", "this help"},
    HelpLine{"Ctrl Q", "quit"},
};

struct Binding {
  int key;
  Action action;
};
constexpr std::array kBindings{
    Binding{GLFW_KEY_RIGHT, Action::kNextView}, Binding{GLFW_KEY_LEFT, Action::kPreviousView},
    Binding{GLFW_KEY_C, Action::kNearestView},  Binding{GLFW_KEY_V, Action::kShowAll},
    Binding{GLFW_KEY_HOME, Action::kHome},      Binding{GLFW_KEY_F1, Action::kHelp},
    Binding{GLFW_KEY_TAB, Action::kPanel},      Binding{GLFW_KEY_P, Action::kSaveImage},
    Binding{GLFW_KEY_F12, Action::kSaveWindow}, Binding{GLFW_KEY_L, Action::kCopyCommand},
    Binding{GLFW_KEY_DOWN, Action::kNextShown}, Binding{GLFW_KEY_UP, Action::kPreviousShown},
    Binding{GLFW_KEY_F, Action::kCameras},      Binding{GLFW_KEY_G, Action::kMagnifier},
    Binding{GLFW_KEY_X, Action::kCompare},      Binding{GLFW_KEY_H, Action::kHideView},
    Binding{GLFW_KEY_M, Action::kMark},         Binding{GLFW_KEY_K, Action::kAddKey},
    Binding{GLFW_KEY_O, Action::kOpenPath},     Binding{GLFW_KEY_SPACE, Action::kFlyPath},
    Binding{GLFW_KEY_R, Action::kRecord},       Binding{GLFW_KEY_T, Action::kPlayTime},
    Binding{GLFW_KEY_N, Action::kNextTimeStep}, Binding{GLFW_KEY_B, Action::kPreviousTimeStep},
    Binding{GLFW_KEY_COMMA, Action::kSlower},   Binding{GLFW_KEY_PERIOD, Action::kFaster},
};

}  // namespace

std::span<const HelpLine> HelpLines() { return kHelp; }

std::optional<Action> ActionOf(int glfw_key, int glfw_mods) {
  if ((glfw_mods & GLFW_MOD_CONTROL) != 0) {
    return glfw_key == GLFW_KEY_Q ? std::optional(Action::kQuit) : std::nullopt;
  }
  for (const Binding& binding : kBindings) {
    if (binding.key == glfw_key) return binding.action;
  }
  return std::nullopt;
}

std::optional<FlyKey> FlyKeyOf(int glfw_key) {
  switch (glfw_key) {
    case GLFW_KEY_W:
      return FlyKey::kForward;
    case GLFW_KEY_S:
      return FlyKey::kBack;
    case GLFW_KEY_A:
      return FlyKey::kLeft;
    case GLFW_KEY_D:
      return FlyKey::kRight;
    case GLFW_KEY_E:
      return FlyKey::kUp;
    case GLFW_KEY_Q:
      return FlyKey::kDown;
    default:
      return std::nullopt;
  }
}

}  // namespace dtr::viewer
