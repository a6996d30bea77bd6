// tests/support/x_screen.h -- what the X server of DISPLAY shows, and keys for its windows.
#pragma once
#include "dtr/types/grid.h"

namespace dtr::testing {

/// The upper left part of the screen. Throws std::runtime_error without a display.
ImageRgb8 ReadScreen(int width, int height);

/// Presses and releases a letter in the topmost window at this pixel of the screen.
void SendKey(char letter, int x, int y);

}  // namespace dtr::testing
