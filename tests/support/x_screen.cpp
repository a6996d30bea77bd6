#include "tests/support/x_screen.h"

#include <memory>
#include <stdexcept>
#include <string>

// Last: Xlib defines words as macros.
#include <X11/Xlib.h>
#include <X11/Xutil.h>

namespace dtr::testing {
namespace {

class Connection {
 public:
  Connection() : display_(XOpenDisplay(nullptr)) {
    if (display_ == nullptr) throw std::runtime_error("no X server");
  }
  ~Connection() { XCloseDisplay(display_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  Display* get() const { return display_; }
  ::Window root() const { return DefaultRootWindow(display_); }

 private:
  Display* const display_;
};

}  // namespace

ImageRgb8 ReadScreen(int width, int height) {
  const Connection x;
  const std::unique_ptr<XImage, int (*)(XImage*)> pixels(
      XGetImage(x.get(), x.root(), 0, 0, static_cast<unsigned>(width),
                static_cast<unsigned>(height), AllPlanes, ZPixmap),
      [](XImage* image) { return XDestroyImage(image); });
  if (!pixels) throw std::runtime_error("the screen cannot be read");
  ImageRgb8 image(width, height, 3);
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) {
      const unsigned long pixel = XGetPixel(pixels.get(), i, j);
      for (int c = 0; c < 3; ++c) {
        image(i, j, c) = static_cast<std::uint8_t>(pixel >> (8 * (2 - c)));
      }
    }
  }
  return image;
}

void SendKey(char letter, int x_px, int y_px) {
  const Connection x;
  ::Window window = 0;
  int local_x = 0, local_y = 0;
  XTranslateCoordinates(x.get(), x.root(), x.root(), x_px, y_px, &local_x, &local_y, &window);
  XKeyEvent event{};
  event.display = x.get();
  event.window = window;
  event.root = x.root();
  event.same_screen = True;
  event.keycode = XKeysymToKeycode(x.get(), XStringToKeysym(std::string(1, letter).c_str()));
  for (const int type : {KeyPress, KeyRelease}) {
    event.type = type;
    const long mask = type == KeyPress ? KeyPressMask : KeyReleaseMask;
    XSendEvent(x.get(), window, True, mask, reinterpret_cast<XEvent*>(&event));
    XFlush(x.get());
  }
  XSync(x.get(), False);
}

}  // namespace dtr::testing
