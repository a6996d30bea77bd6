#include "dtr/prune/judge.h"

#include <algorithm>
#include <cmath>

#include "dtr/eval/metrics.h"
#include "dtr/types/area_average.h"

namespace dtr::prune {
namespace {

// Equal pictures have no error at all; one that is smaller than this no eye and no 8 bits show.
constexpr double kSmallestError = 1e-3;

double MeanOf(const eval::SquaredError& error) {
  return error.samples > 0 ? error.sum / static_cast<double>(error.samples) : 0;
}

double PsnrDb(double error) { return 10 * std::log10(255 * 255 / std::max(error, kSmallestError)); }

}  // namespace

std::vector<Place> HeldOutPlaces(const DtrSet& set) {
  std::vector<Place> places;
  for (const View& view : set.frames.front().views) {
    if (view.role != ViewRole::kHeldOut || view.image.empty()) continue;
    places.push_back({{view.camera, view.cam_from_world}, view.image, view.mask, {}});
  }
  return places;
}

namespace {

std::vector<std::string> IdsAt(const View& place, const DtrSet& set) {
  std::vector<std::string> ids;
  for (const View& view : set.frames.front().views) {
    const bool same =
        view.role == ViewRole::kSource &&
        view.cam_from_world.translation == place.cam_from_world.translation &&
        view.cam_from_world.rotation.coeffs() == place.cam_from_world.rotation.coeffs();
    if (same) ids.push_back(view.id);
  }
  return ids;
}

}  // namespace

std::vector<Place> LeftOutPlaces(const DtrSet& set, int count, int shrink) {
  const RenderScene scene = MakeRenderScene(set);
  const size_t views = scene.views.size(), n = std::min(views, static_cast<size_t>(count));
  std::vector<Place> places;
  for (size_t i = 0; i < n; ++i) {
    const View& view = *scene.views[i * views / n];
    const int width = std::max(1, view.camera.width_px() / shrink);
    const int height = std::max(1, view.camera.height_px() / shrink);
    places.push_back({{view.camera.Resized(width, height), view.cam_from_world},
                      AreaAverage(view.image, width, height),
                      view.mask.empty() ? Mask() : ShrinkMask(view.mask, width, height),
                      IdsAt(view, set)});
  }
  return places;
}

std::vector<Place> NovelPlaces(std::vector<NovelCamera> cameras) {
  std::vector<Place> places;
  for (const NovelCamera& novel : cameras) places.push_back({novel, {}, {}, {}});
  return places;
}

std::vector<ImageRgb8> Pictures(const DtrSet& set, std::span<const std::string> without,
                                std::span<const Place> places, const RenderOptions& options,
                                const eval::RenderFunction& render) {
  RenderOptions filled = options;
  filled.fill_holes = true;
  std::vector<ImageRgb8> pictures;
  for (const Place& place : places) {
    std::vector<std::string> excluded(without.begin(), without.end());
    excluded.insert(excluded.end(), place.left_out.begin(), place.left_out.end());
    pictures.push_back(render(MakeRenderScene(set, excluded), place.novel.camera,
                              place.novel.cam_from_world, filled)
                           .image);
  }
  return pictures;
}

double Errors::NewErrorShare() const {
  if (!(change > 0)) return 1;
  return std::max(kLeastShare, (after - before) / change);
}

Errors CompareWithPhotos(std::span<const Place> places, std::span<const ImageRgb8> before,
                         std::span<const ImageRgb8> after) {
  Errors errors;
  long long samples = 0;
  for (size_t i = 0; i < places.size(); ++i) {
    const Place& place = places[i];
    const auto was = eval::CompareSquared(before[i], place.photo, place.mask);
    const auto is = eval::CompareSquared(after[i], place.photo, place.mask);
    errors.before += was.sum;
    errors.after += is.sum;
    errors.change += eval::CompareSquared(before[i], after[i], place.mask).sum;
    samples += was.samples;
    errors.psnr_loss_db += PsnrDb(MeanOf(was)) - PsnrDb(MeanOf(is));
  }
  const double count = std::max(1.0, static_cast<double>(samples));
  errors.before = std::max(errors.before / count, kSmallestError);
  errors.after = std::max(errors.after / count, kSmallestError);
  errors.change /= count;
  errors.psnr_loss_db /= std::max(1.0, static_cast<double>(places.size()));
  return errors;
}

double LossDb(std::span<const ImageRgb8> before, std::span<const ImageRgb8> after,
              const Errors& where_photos_are) {
  const double share = where_photos_are.NewErrorShare() / where_photos_are.before;
  double sum_db = 0;
  for (size_t i = 0; i < before.size(); ++i) {
    const double difference = MeanOf(eval::CompareSquared(before[i], after[i], {}));
    sum_db += 10 * std::log10(1 + share * difference);
  }
  return before.empty() ? 0 : sum_db / static_cast<double>(before.size());
}

}  // namespace dtr::prune
