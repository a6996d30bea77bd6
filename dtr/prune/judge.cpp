#include "dtr/prune/judge.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dtr/eval/metrics.h"

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

Grid<std::uint8_t> Window(const Grid<std::uint8_t>& image, int x, int y, int width, int height) {
  Grid<std::uint8_t> window(width, height, image.channels());
  for (int j = 0; j < height; ++j) {
    std::copy_n(image.row(y + j) + static_cast<std::ptrdiff_t>(x) * image.channels(),
                static_cast<std::ptrdiff_t>(width) * image.channels(), window.row(j));
  }
  return window;
}

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

std::vector<Place> LeftOutPlaces(const DtrSet& set, int count, int crop) {
  const RenderScene scene = MakeRenderScene(set);
  const size_t views = scene.views.size(), n = std::min(views, static_cast<size_t>(count));
  std::vector<Place> places;
  for (size_t i = 0; i < n; ++i) {
    const View& view = *scene.views[i * views / n];
    const auto cell = static_cast<int>(i) % (crop * crop);
    const PinholeCamera& camera = view.camera;
    const int width = std::max(1, camera.width_px() / crop);
    const int height = std::max(1, camera.height_px() / crop);
    const int x = std::min(cell % crop * width, camera.width_px() - width);
    const int y = std::min(cell / crop * height, camera.height_px() - height);
    const PinholeCamera window(width, height, camera.fx_px(), camera.fy_px(), camera.cx_px() - x,
                               camera.cy_px() - y);
    places.push_back({{window, view.cam_from_world},
                      Window(view.image, x, y, width, height),
                      view.mask.empty() ? Mask() : Window(view.mask, x, y, width, height),
                      IdsAt(view, set)});
  }
  return places;
}

std::vector<Place> WitnessPlaces(const DtrSet& set, std::span<const Place> deciding, int count) {
  constexpr int kAll = std::numeric_limits<int>::max(), kWhole = 1;
  std::vector<Place> all = LeftOutPlaces(set, kAll, kWhole), others;
  for (const Place& place : all) {
    const bool decides = std::any_of(deciding.begin(), deciding.end(), [&](const Place& other) {
      return other.left_out == place.left_out;
    });
    if (!decides) others.push_back(place);
  }
  if (others.empty()) others = std::move(all);
  const size_t n = std::min(others.size(), static_cast<size_t>(count));
  std::vector<Place> witnesses;
  for (size_t i = 0; i < n; ++i) witnesses.push_back(std::move(others[i * others.size() / n]));
  return witnesses;
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
