#include "pipeline/export/detail/sample_colours.h"

#include "dtr/io/set_io.h"
#include "dtr/render/exposure.h"

namespace dtr::pipeline {
namespace {

ImageRgb8 BlockMeans(const ImageRgb8& image, int side) {
  ImageRgb8 means(image.width() / side, image.height() / side, 3);
  for (int y = 0; y < means.height(); ++y) {
    for (int x = 0; x < means.width(); ++x) {
      for (int c = 0; c < 3; ++c) {
        int sum = side * side / 2;
        for (int i = 0; i < side * side; ++i) {
          sum += image(side * x + i % side, side * y + i / side, c);
        }
        means(x, y, c) = static_cast<std::uint8_t>(sum / (side * side));
      }
    }
  }
  return means;
}

}  // namespace

ImageRgb8 ColoursOnDepthGrid(const std::filesystem::path& set_folder, View view) {
  io::LoadOptions load;
  load.depth = false;
  io::LoadPixels(set_folder, view, load);
  if (const auto curve = CurveOf(view.gain)) curve->Apply(view.image);
  return view.depth_scale == 1 ? std::move(view.image) : BlockMeans(view.image, view.depth_scale);
}

}  // namespace dtr::pipeline
