#include "dtr/prune/image_loss.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "dtr/eval/metrics.h"

namespace dtr::prune {
namespace {

// Equal images have no error at all; one that is smaller than this no eye and no 8 bits show.
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

/// A part of an image: the n-th of crop x crop, over and over.
struct WindowOf {
  WindowOf(const PinholeCamera& whole, int n, int crop)
      : width(std::max(1, whole.width_px() / crop)),
        height(std::max(1, whole.height_px() / crop)),
        x(std::min(n % (crop * crop) % crop * width, whole.width_px() - width)),
        y(std::min(n % (crop * crop) / crop * height, whole.height_px() - height)),
        camera(width, height, whole.fx_px(), whole.fy_px(), whole.cx_px() - x, whole.cy_px() - y) {}
  Grid<std::uint8_t> Of(const Grid<std::uint8_t>& image) const {
    Grid<std::uint8_t> window(width, height, image.channels());
    for (int j = 0; j < height; ++j) {
      std::copy_n(image.row(y + j) + static_cast<std::ptrdiff_t>(x) * image.channels(),
                  static_cast<std::ptrdiff_t>(width) * image.channels(), window.row(j));
    }
    return window;
  }
  int width, height, x, y;
  PinholeCamera camera;
};

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
    const WindowOf window(view.camera, static_cast<int>(i), crop);
    places.push_back({{window.camera, view.cam_from_world},
                      window.Of(view.image),
                      view.mask.empty() ? Mask() : window.Of(view.mask),
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

std::vector<NovelCamera> Windows(std::vector<NovelCamera> cameras, int crop) {
  for (size_t i = 0; i < cameras.size(); ++i) {
    cameras[i].camera = WindowOf(cameras[i].camera, static_cast<int>(i), crop).camera;
  }
  return cameras;
}

std::vector<Place> NovelPlaces(const std::vector<NovelCamera>& cameras) {
  std::vector<Place> places;
  for (const NovelCamera& novel : cameras) places.push_back({novel, {}, {}, {}});
  return places;
}

std::vector<ImageRgb8> Images(const DtrSet& set, std::span<const std::string> without,
                              std::span<const Place> places, const RenderOptions& options,
                              const eval::RenderFunction& render, std::vector<Mask>* coverage) {
  RenderOptions filled = options;
  filled.fill_holes = true;
  if (coverage != nullptr) coverage->clear();
  std::vector<ImageRgb8> pictures;
  for (const Place& place : places) {
    std::vector<std::string> excluded(without.begin(), without.end());
    excluded.insert(excluded.end(), place.left_out.begin(), place.left_out.end());
    RenderResult drawn = render(MakeRenderScene(set, excluded), place.novel.camera,
                                place.novel.cam_from_world, filled);
    pictures.push_back(std::move(drawn.image));
    if (coverage != nullptr) coverage->push_back(std::move(drawn.coverage));
  }
  return pictures;
}

double Errors::NewErrorShare() const {
  if (!(change > 0)) return 1;
  return std::max(kMinShare, (after - before) / change);
}

Errors CompareWithPhotos(std::span<const Place> places, std::span<const ImageRgb8> before,
                         std::span<const ImageRgb8> after) {
  Errors errors;
  std::vector<double> losses_db;
  long long samples = 0;
  for (size_t i = 0; i < places.size(); ++i) {
    const Place& place = places[i];
    const auto was = eval::CompareSquared(before[i], place.photo, place.mask);
    const auto is = eval::CompareSquared(after[i], place.photo, place.mask);
    errors.before += was.sum;
    errors.after += is.sum;
    errors.change += eval::CompareSquared(before[i], after[i], place.mask).sum;
    samples += was.samples;
    losses_db.push_back(PsnrDb(MeanOf(was)) - PsnrDb(MeanOf(is)));
  }
  const double count = std::max(1.0, static_cast<double>(samples));
  errors.before = std::max(errors.before / count, kSmallestError);
  errors.after = std::max(errors.after / count, kSmallestError);
  errors.change /= count;
  errors.psnr_loss_db = MeanOf(losses_db);
  errors.psnr_loss_error_db = StandardError(losses_db);
  return errors;
}

double MeanOf(std::span<const double> values) {
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

double StandardError(std::span<const double> values) {
  if (values.size() < 2) return 0;
  const double mean = MeanOf(values), count = static_cast<double>(values.size());
  double squared = 0;
  for (const double value : values) squared += (value - mean) * (value - mean);
  return std::sqrt(squared / (count - 1) / count);
}

std::vector<double> Changes(std::span<const Place> places, std::span<const ImageRgb8> before,
                            std::span<const ImageRgb8> after) {
  std::vector<double> changes;
  for (size_t i = 0; i < places.size(); ++i) {
    changes.push_back(MeanOf(eval::CompareSquared(before[i], after[i], places[i].mask)));
  }
  return changes;
}

std::vector<double> LossesDb(std::span<const double> recoded, std::span<const double> removed,
                             const Errors& where_photos_are) {
  const double share = where_photos_are.NewErrorShare();
  std::vector<double> losses_db;
  for (size_t i = 0; i < recoded.size(); ++i) {
    const double added = share * recoded[i] + removed[i];
    losses_db.push_back(10 * std::log10(1 + added / where_photos_are.before));
  }
  return losses_db;
}

}  // namespace dtr::prune
