#include "viewer/glfw/frame_texture.h"

#include <epoxy/gl.h>

#include <cstdint>
#include <vector>

namespace dtr::viewer {

FrameTexture::~FrameTexture() {
  if (name_ != 0) glDeleteTextures(1, &name_);
}

void FrameTexture::Fit(int width_px, int height_px) {
  if (name_ != 0 && width_px == width_px_ && height_px == height_px_) return;
  if (name_ != 0) glDeleteTextures(1, &name_);  // its storage cannot change
  glGenTextures(1, &name_);
  glBindTexture(GL_TEXTURE_2D, name_);
  glTexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA8, width_px, height_px);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  width_px_ = width_px;
  height_px_ = height_px;
}

void FrameTexture::Take(const gl::DrawnFrame& drawn) {
  Fit(drawn.width_px, drawn.height_px);
  if (drawn.rgba != nullptr) {
    Send(drawn.rgba);
    return;
  }
  glCopyImageSubData(drawn.image, GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, name_, GL_TEXTURE_2D, 0, 0, 0, 0,
                     drawn.width_px, drawn.height_px, 1);
}

void FrameTexture::Upload(const ImageRgb8& image, const Mask& alpha) {
  Fit(image.width(), image.height());
  const size_t pixels = static_cast<size_t>(image.width()) * static_cast<size_t>(image.height());
  std::vector<std::uint8_t> rgba(4 * pixels);
  for (size_t p = 0; p < pixels; ++p) {
    for (size_t c = 0; c < 3; ++c) rgba[4 * p + c] = image.data()[3 * p + c];
    rgba[4 * p + 3] = alpha.empty() ? 255 : alpha.data()[p];
  }
  Send(rgba.data());
}

void FrameTexture::Send(const void* rgba) {
  glBindTexture(GL_TEXTURE_2D, name_);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width_px_, height_px_, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
}

}  // namespace dtr::viewer
