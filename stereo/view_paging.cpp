#include "stereo/view_paging.h"

#include <algorithm>

#include "stereo/prior_use.h"
#include "stereo/time_step.h"

namespace dtr::stereo {
namespace {

std::uint64_t PixelsOf(const PinholeCamera& camera) {
  return static_cast<std::uint64_t>(camera.width_px()) *
         static_cast<std::uint64_t>(camera.height_px());
}

}  // namespace

// An image and a mask, three slopes and inverse depths, depth and sigma.
std::uint64_t PixelBytes(const PinholeCamera& camera) { return 4 * PixelsOf(camera); }
std::uint64_t PlaneBytes(const PinholeCamera& camera) { return 12 * PixelsOf(camera); }
std::uint64_t EstimateBytes(const PinholeCamera& camera) { return 8 * PixelsOf(camera); }

std::uint64_t OtherBytes(const StereoView& view) {
  return (view.prior != nullptr ? PriorBytes(view.camera) : 0) +
         (view.time_step != nullptr ? TimeStepBytes(view.camera) : 0);
}

std::shared_ptr<const PlaneMap> PagedPlanes::Load(int pass, int view) {
  return pages_.Get<PlaneMap>({PageKey::Kind::kPlanes, pass, view},
                              PlaneBytes(views_[static_cast<size_t>(view)].camera),
                              [&] { return store_.Load(pass, view); });
}

void PagedPlanes::Drop(int pass) {
  pages_.Drop(
      [&](const PageKey& key) { return key.kind == PageKey::Kind::kPlanes && key.pass == pass; });
  store_.Drop(pass);
}

std::shared_ptr<const DepthEstimate> PagedEstimates::Load(int view) {
  return pages_.Get<DepthEstimate>({PageKey::Kind::kEstimate, 0, view},
                                   EstimateBytes(views_[static_cast<size_t>(view)].camera),
                                   [&] { return store_.Load(view); });
}

void PagedEstimates::Drop(int view) {
  pages_.Drop(
      [&](const PageKey& key) { return key.kind == PageKey::Kind::kEstimate && key.view == view; });
  store_.Drop(view);
}

ViewsAround::ViewsAround(std::span<const StereoView> views, const PixelLoader& load, Pages& pages,
                         int view, std::span<const int> neighbours)
    : views_(views) {
  if (!load) return;
  copies_.assign(views.begin(), views.end());
  const auto hold = [&](int v) {
    StereoView& copy = copies_[static_cast<size_t>(v)];
    held_.push_back(
        pages.Get<StereoPixels>({PageKey::Kind::kPixels, 0, v}, PixelBytes(copy.camera),
                                [&] { return std::make_shared<const StereoPixels>(load(v)); }));
    copy.image = &held_.back()->image;
    copy.mask = &held_.back()->mask;
  };
  hold(view);
  std::for_each(neighbours.begin(), neighbours.end(), hold);
  views_ = copies_;
}

std::uint64_t LeastBytes(std::span<const StereoView> views, const Engine& engine, int view,
                         std::span<const int> neighbours, bool pixels_are_paged, bool filters) {
  std::uint64_t pixels = 0, planes = 0, estimates = 0, largest_page = 0;
  const auto add = [&](int v) {
    const PinholeCamera& camera = views[static_cast<size_t>(v)].camera;
    const std::uint64_t own_pixels = pixels_are_paged ? PixelBytes(camera) : 0;
    const std::uint64_t own_planes = engine.Passes() > 0 ? PlaneBytes(camera) : 0;
    pixels += own_pixels;
    planes += own_planes;
    estimates += filters || v == view ? EstimateBytes(camera) : 0;
    largest_page = std::max({largest_page, own_pixels, own_planes, EstimateBytes(camera)});
  };
  add(view);
  std::for_each(neighbours.begin(), neighbours.end(), add);
  const PinholeCamera& camera = views[static_cast<size_t>(view)].camera;
  // What is loaded last is there twice for a while; so is the filter's result, when it is written.
  constexpr std::uint64_t kMore = Pages::kLoadingCopies - 1;
  const std::uint64_t loading = pixels + planes + kMore * largest_page;
  const std::uint64_t working = pixels + planes + engine.WorkBytes(views, view, neighbours);
  const std::uint64_t other = filters ? OtherBytes(views[static_cast<size_t>(view)]) : 0;
  const std::uint64_t filtering =
      estimates + std::max(kMore * largest_page, kResultCopies * EstimateBytes(camera)) + other;
  return std::max({loading, working, filtering});
}

}  // namespace dtr::stereo
