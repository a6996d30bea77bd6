#include "pipeline/core/cameras/photo_scale.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "calib/scaled_lens.h"
#include "dtr/base/size_text.h"

namespace dtr::pipeline {
namespace {

using Size = std::pair<int, int>;

// Whether one scale brings both sides to those of the copy, within the pixel that rounding takes.
bool IsScaledCopy(const calib::LensCamera& camera, const Size& copy) {
  constexpr double kRoundingPx = 1, kLeastChange = 0.02;
  const double w = camera.width_px, h = camera.height_px;
  const double least = std::max((copy.first - kRoundingPx) / w, (copy.second - kRoundingPx) / h);
  const double most = std::min((copy.first + kRoundingPx) / w, (copy.second + kRoundingPx) / h);
  return least <= most && std::abs(copy.first / w - 1) > kLeastChange;
}

// The size that a camera must be scaled to; empty: none.
std::optional<Size> SizeToScaleTo(const calib::LensCamera& camera, const StoredSize& photo,
                                  PhotoGrid convention) {
  const Size own{camera.width_px, camera.height_px};
  std::optional<Size> scaled;
  for (const PhotoGrid grid : {PhotoGrid::kStored, PhotoGrid::kUpright}) {
    const Size size{photo.WidthOn(grid), photo.HeightOn(grid)};
    if (size == own) return std::nullopt;
    if (IsScaledCopy(camera, size) && (!scaled || grid == convention)) scaled = size;
  }
  return scaled;
}

}  // namespace

std::string ScaleToPhotos(const std::map<std::string, StoredSize>& sizes, PhotoGrid convention,
                          const std::string& source, calib::SfmModel& model) {
  std::map<std::tuple<std::uint32_t, int, int>, std::uint32_t> scaled_id;  // of camera and size
  std::uint32_t next_id = model.cameras.empty() ? 1 : model.cameras.rbegin()->first + 1;
  int scaled = 0;
  std::string first;
  for (calib::SfmImage& image : model.images) {
    const auto photo = sizes.find(image.name);
    if (photo == sizes.end()) continue;
    const calib::LensCamera camera = model.cameras.at(image.camera_id);
    const auto size = SizeToScaleTo(camera, photo->second, convention);
    if (!size) continue;
    const auto [width_px, height_px] = *size;
    const auto [id, fresh] = scaled_id.try_emplace({image.camera_id, width_px, height_px}, next_id);
    if (fresh) model.cameras[next_id++] = calib::ScaledTo(camera, width_px, height_px);
    image.camera_id = id->second;
    const Eigen::Array2d scale(static_cast<double>(width_px) / camera.width_px,
                               static_cast<double>(height_px) / camera.height_px);
    for (calib::SfmFeature& feature : image.features) feature.pixel.array() *= scale;
    if (scaled++ > 0) continue;
    first = fmt::format("its cameras are of images of {}, {} has {}: scaled by {:.6g}",
                        SizeText(camera.width_px, camera.height_px), image.name,
                        SizeText(width_px, height_px), scale.x());
  }
  if (scaled == 0) return "";
  for (const auto& [from, id] : scaled_id) {
    if (!calib::HasImages(model, std::get<0>(from))) model.cameras.erase(std::get<0>(from));
  }
  return fmt::format("{}: {} ({} of {} images)", source, first, scaled, model.images.size());
}

}  // namespace dtr::pipeline
