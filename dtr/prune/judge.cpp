#include "dtr/prune/judge.h"

#include <algorithm>
#include <cmath>

#include "dtr/base/error.h"
#include "dtr/eval/metrics.h"
#include "dtr/types/area_average.h"

namespace dtr::prune {
namespace {

// Equal pictures have no error at all; one that is smaller than this no eye and no 8 bits show.
constexpr double kSmallestError = 1e-3;

double MeanOf(const eval::SquaredError& error) {
  return error.samples > 0 ? error.sum / static_cast<double>(error.samples) : 0;
}

ImageRgb8 PictureFrom(const RenderScene& scene, const NovelCamera& camera, RenderOptions options,
                      const eval::RenderFunction& render) {
  options.fill_holes = true;
  return render(scene, camera.camera, camera.cam_from_world, options).image;
}

/// Against the photo of `view`, both at 1/shrink of its size.
eval::SquaredError AgainstPhoto(const RenderScene& scene, const View& view, int shrink,
                                const RenderOptions& options, const eval::RenderFunction& render) {
  const int width = std::max(1, view.camera.width_px() / shrink);
  const int height = std::max(1, view.camera.height_px() / shrink);
  const NovelCamera camera{view.camera.Resized(width, height), view.cam_from_world};
  const ImageRgb8 picture = PictureFrom(scene, camera, options, render);
  if (shrink == 1) return eval::CompareSquared(picture, view.image, view.mask);
  return eval::CompareSquared(picture, AreaAverage(view.image, width, height),
                              view.mask.empty() ? Mask() : ShrinkMask(view.mask, width, height));
}

std::vector<const View*> HeldOut(const DtrSet& set) {
  std::vector<const View*> views;
  for (const View& view : set.frames.front().views) {
    if (view.role == ViewRole::kHeldOut && !view.image.empty()) views.push_back(&view);
  }
  return views;
}

}  // namespace

std::vector<ImageRgb8> Pictures(const DtrSet& set, std::span<const std::string> without,
                                std::span<const NovelCamera> cameras, const RenderOptions& options,
                                const eval::RenderFunction& render) {
  const RenderScene scene = MakeRenderScene(set, without);
  std::vector<ImageRgb8> pictures;
  for (const NovelCamera& camera : cameras) {
    pictures.push_back(PictureFrom(scene, camera, options, render));
  }
  return pictures;
}

double ErrorAgainstPhotos(const DtrSet& set, const RenderOptions& options, int shrink, int at_most,
                          const eval::RenderFunction& render) {
  eval::SquaredError total;
  const auto add = [&](const eval::SquaredError& error) {
    total.sum += error.sum;
    total.samples += error.samples;
  };
  const std::vector<const View*> held_out = HeldOut(set);
  if (!held_out.empty()) {
    const RenderScene scene = MakeRenderScene(set);
    for (const View* view : held_out) add(AgainstPhoto(scene, *view, shrink, options, render));
  } else {
    const RenderScene all = MakeRenderScene(set);
    const size_t count = std::min(all.views.size(), static_cast<size_t>(at_most));
    for (size_t i = 0; i < count; ++i) {
      const View& view = *all.views[i * all.views.size() / count];
      const std::vector<std::string> without = {view.id};
      add(AgainstPhoto(MakeRenderScene(set, without), view, shrink, options, render));
    }
  }
  return std::max(MeanOf(total), kSmallestError);
}

std::vector<double> PhotoPsnr(const DtrSet& set, std::span<const std::string> without,
                              const RenderOptions& options, const eval::RenderFunction& render) {
  std::vector<double> psnr_db;
  const RenderScene scene = MakeRenderScene(set, without);
  for (const View* view : HeldOut(set)) {
    const double error = MeanOf(AgainstPhoto(scene, *view, 1, options, render));
    psnr_db.push_back(10 * std::log10(255 * 255 / std::max(error, kSmallestError)));
  }
  return psnr_db;
}

double LossDb(std::span<const ImageRgb8> before, std::span<const ImageRgb8> after, double error) {
  double sum_db = 0;
  for (size_t i = 0; i < before.size(); ++i) {
    const double difference = MeanOf(eval::CompareSquared(before[i], after[i], {}));
    sum_db += 10 * std::log10(1 + difference / error);
  }
  return before.empty() ? 0 : sum_db / static_cast<double>(before.size());
}

std::vector<NovelCamera> Shrunk(std::vector<NovelCamera> cameras, int shrink) {
  for (NovelCamera& novel : cameras) {
    novel.camera = novel.camera.Resized(std::max(1, novel.camera.width_px() / shrink),
                                        std::max(1, novel.camera.height_px() / shrink));
  }
  return cameras;
}

}  // namespace dtr::prune
