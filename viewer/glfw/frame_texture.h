// viewer/glfw/frame_texture.h -- an image on the GPU that stays when the renderer draws another.
#pragma once
#include "dtr/gl/renderer.h"
#include "dtr/types/grid.h"

namespace dtr::viewer {

/// A GL_TEXTURE_2D of 8-bit sRGB values with alpha (255: to be shown). Belongs to the context it
/// was made with.
class FrameTexture {
 public:
  FrameTexture() = default;
  ~FrameTexture();
  FrameTexture(const FrameTexture&) = delete;
  FrameTexture& operator=(const FrameTexture&) = delete;

  /// Copies what the renderer drew, from the GPU or from memory.
  void Take(const gl::DrawnFrame& drawn);
  /// `alpha` empty: all of it is shown; else of the image's size.
  void Upload(const ImageRgb8& image, const Mask& alpha = {});

  bool empty() const { return width_px_ == 0; }
  unsigned name() const { return name_; }
  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }

 private:
  void Fit(int width_px, int height_px);
  void Send(const void* rgba);

  unsigned name_ = 0;
  int width_px_ = 0, height_px_ = 0;
};

}  // namespace dtr::viewer
