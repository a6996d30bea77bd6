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

}  // namespace dtr::gl
