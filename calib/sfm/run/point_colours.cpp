#include "calib/sfm/run/point_colours.h"

#include <algorithm>
#include <array>
#include <map>

#include "dtr/base/parallel_for.h"
#include "dtr/io/image_io.h"

namespace dtr::sfm {
namespace {

struct ColourSum {
  std::array<int, 3> rgb{};
  int count = 0;
};

using Sample = std::pair<std::uint64_t, std::array<std::uint8_t, 3>>;

std::vector<Sample> SamplesOf(const ImageRgb8& photo, const calib::SfmImage& image) {
  std::vector<Sample> samples;
  for (const calib::SfmFeature& feature : image.features) {
    if (feature.point_id == calib::SfmFeature::kNoPoint) continue;
    const double x = feature.pixel.x(), y = feature.pixel.y();
    if (!(x >= 0 && y >= 0 && x < photo.width() && y < photo.height())) continue;
    const std::uint8_t* rgb = photo.row(static_cast<int>(y)) + 3 * static_cast<size_t>(x);
    samples.push_back({feature.point_id, {rgb[0], rgb[1], rgb[2]}});
  }
  return samples;
}

}  // namespace

void ColourPoints(Workspace& workspace, calib::SfmModel& model) {
  std::map<std::string, size_t> index_of;
  for (size_t i = 0; i < workspace.images().size(); ++i) {
    index_of[workspace.images()[i].name] = i;
  }
  std::vector<std::vector<Sample>> samples(model.images.size());
  ParallelFor(0, static_cast<int>(model.images.size()), [&](int i) {
    workspace.progress().ThrowIfInterrupted();
    const calib::SfmImage& image = model.images[static_cast<size_t>(i)];
    samples[static_cast<size_t>(i)] = SamplesOf(
        io::ReadImage(workspace.FileOf(index_of.at(image.name)), {.memory_gb = 0}), image);
  });
  std::map<std::uint64_t, ColourSum> sums;
  for (const auto& of_image : samples) {
    for (const auto& [id, rgb] : of_image) {
      ColourSum& sum = sums[id];
      for (size_t c = 0; c < 3; ++c) sum.rgb[c] += rgb[c];
      ++sum.count;
    }
  }
  for (const auto& [id, sum] : sums) {
    for (size_t c = 0; c < 3; ++c) {
      const int rounded = (sum.rgb[c] + sum.count / 2) / sum.count;
      model.points.at(id).rgb[c] = static_cast<std::uint8_t>(rounded);
    }
  }
}

}  // namespace dtr::sfm
