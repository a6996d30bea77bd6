#include "dtr/gl/read_back.h"

#include <cstdint>
#include <vector>

namespace dtr::gl {

void ReadBack(const Targets& targets, const Band& band, RenderResult& result) {
  const int width = targets.width;
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(band.count);
  std::vector<std::uint8_t> image(4 * pixels), marks(4 * pixels);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, targets.result_framebuffer.name());
  const auto read = [&](GLenum attachment, GLenum format, GLenum type, void* data) {
    glReadBuffer(attachment);
    glReadPixels(0, 0, width, band.count, format, type, data);
  };
  read(GL_COLOR_ATTACHMENT0, GL_RGBA, GL_UNSIGNED_BYTE, image.data());
  read(GL_COLOR_ATTACHMENT1, GL_RED, GL_FLOAT, result.depth.row(band.first));
  read(GL_COLOR_ATTACHMENT2, GL_RGBA_INTEGER, GL_UNSIGNED_BYTE, marks.data());
  StoreRows(band, width, image.data(), marks.data(), result);
}

void StoreRows(const Band& band, int width_px, const std::uint8_t* image, const std::uint8_t* marks,
               RenderResult& result) {
  const size_t pixels = static_cast<size_t>(width_px) * static_cast<size_t>(band.count);
  const size_t first = static_cast<size_t>(band.first) * static_cast<size_t>(width_px);
  for (size_t p = 0; p < pixels; ++p) {
    for (size_t c = 0; c < 3; ++c) result.image.data()[3 * (first + p) + c] = image[4 * p + c];
    result.coverage.data()[first + p] = image[4 * p + 3];
    result.view_count.data()[first + p] = marks[4 * p];
    result.delta_border.data()[first + p] = marks[4 * p + 1];
  }
}

}  // namespace dtr::gl
