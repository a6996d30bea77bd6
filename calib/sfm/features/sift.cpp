#include "calib/sfm/features/sift.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "calib/sfm/features/descriptor.h"
#include "calib/sfm/features/patch_kernel.h"
#include "calib/sfm/features/scale_space.h"
#include "calib/sfm/features/source_image.h"
#include "dtr/types/area_average.h"

namespace dtr::sfm {
namespace {

constexpr int kMinSidePx = 8;

struct Size {
  int width = 0, height = 0;
};

/// A feature before its descriptor.
struct Located {
  Keypoint keypoint;  ///< of the photo
  size_t octave = 0;
  const Extremum* extremum = nullptr;
};

bool IsLarger(const Keypoint& a, const Keypoint& b) {
  return std::tuple(-a.scale_px, a.y_px, a.x_px, a.orientation_rad) <
         std::tuple(-b.scale_px, b.y_px, b.x_px, b.orientation_rad);
}

void Check(size_t values, Size size, size_t mask_values, const SiftOptions& options) {
  const auto require = [](bool holds, const char* what) {
    if (!holds) throw std::invalid_argument(what);
  };
  require(size.width > 0 && size.height > 0, "DetectSift: sizes must be positive");
  const size_t pixels = static_cast<size_t>(size.width) * static_cast<size_t>(size.height);
  require(values == pixels, "DetectSift: expected as many values as the image has pixels");
  require(mask_values == 0 || mask_values == pixels,
          "DetectSift: expected a mask of the image's size");
  require(options.max_features >= 0 && options.max_size_px >= 0 && options.octaves >= 1 &&
              options.max_orientations >= 1,
          "DetectSift: counts and sizes in the options must not be negative");
  require(options.min_contrast > 0 && options.max_curvature_ratio >= 1,
          "DetectSift: expected min_contrast above 0 and max_curvature_ratio of at least 1");
}

Size WorkingSize(Size photo, const SiftOptions& options) {
  const auto [width, height] = TargetSize(photo.width, photo.height, options.max_size_px);
  return {width, height};
}

/// Number of octaves for an image: each is half the one before, none has a side below kMinSidePx.
int OctaveCount(Size working, const SiftOptions& options) {
  int count = 0;
  for (int side = 2 * std::min(working.width, working.height);
       side >= kMinSidePx && count < options.octaves; side /= 2) {
    ++count;
  }
  return count;
}

std::vector<Octave> Octaves(const RowStore& image, Size working, const SiftOptions& options) {
  const ExtremumLimits limits{options.min_contrast, options.max_curvature_ratio};
  std::vector<Octave> octaves;
  octaves.push_back(FirstOctave(image, working.height, limits));
  const int count = OctaveCount(working, options);
  while (static_cast<int>(octaves.size()) < count) {
    octaves.push_back(NextOctave(octaves.back(), limits));
  }
  return octaves;
}

/// From pixels of an octave, centres at whole numbers, to the photo's, centres at halves. An
/// octave's first pixel lies on that of the image at its own size.
Keypoint InPhoto(const Extremum& e, double pixel, double x_scale, double y_scale) {
  Keypoint k;
  k.x_px = static_cast<float>((e.x * pixel + 0.5) * x_scale);
  k.y_px = static_cast<float>((e.y * pixel + 0.5) * y_scale);
  k.scale_px = static_cast<float>(e.sigma * pixel * std::sqrt(x_scale * y_scale));
  return k;
}

bool IsMasked(const Keypoint& k, Size photo, std::span<const std::uint8_t> mask) {
  if (mask.empty()) return false;
  const int x = std::clamp(static_cast<int>(k.x_px), 0, photo.width - 1);
  const int y = std::clamp(static_cast<int>(k.y_px), 0, photo.height - 1);
  return mask[static_cast<size_t>(y) * static_cast<size_t>(photo.width) + static_cast<size_t>(x)] ==
         0;
}

/// The first `count` of `all` by size, in the order they were in.
std::vector<Located> Largest(std::vector<Located> all, size_t count) {
  if (all.size() <= count) return all;
  std::vector<Located> sorted = all;
  const auto larger = [](const Located& a, const Located& b) {
    return IsLarger(a.keypoint, b.keypoint);
  };
  if (count == 0) return {};
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(count - 1),
                   sorted.end(), larger);
  const Located last = sorted[count - 1];
  std::erase_if(all, [&](const Located& l) { return larger(last, l); });
  all.resize(std::min(all.size(), count));  // features that are the same to the last bit
  return all;
}

/// Patches that follow each other then lie near each other in memory. Extrema that the refinement
/// of several pixels led to are kept once: two of the same would fail every ratio test.
void SortAndUnite(std::vector<Located>* all) {
  constexpr float kBandRows = 32;
  const auto key = [](const Located& l) {
    const Extremum& e = *l.extremum;
    return std::tuple(l.octave, e.level, static_cast<int>(e.y / kBandRows), e.x, e.y, e.sigma);
  };
  std::sort(all->begin(), all->end(),
            [&](const Located& a, const Located& b) { return key(a) < key(b); });
  const auto same = [&](const Located& a, const Located& b) { return key(a) == key(b); };
  all->erase(std::unique(all->begin(), all->end(), same), all->end());
}

std::vector<Located> LocatedIn(const std::vector<Octave>& octaves, Size photo, Size working,
                               std::span<const std::uint8_t> mask) {
  const double x_scale = static_cast<double>(photo.width) / working.width;
  const double y_scale = static_cast<double>(photo.height) / working.height;
  std::vector<Located> all;
  for (size_t o = 0; o < octaves.size(); ++o) {
    for (const Extremum& e : octaves[o].extrema) {
      const Keypoint k = InPhoto(e, octaves[o].pixel, x_scale, y_scale);
      if (!IsMasked(k, photo, mask)) all.push_back({k, o, &e});
    }
  }
  return all;
}

PatchPosition PatchOf(const Octave& octave, const Extremum& e) {
  const RowStore& level = octave.levels[static_cast<size_t>(e.level)];
  return {level.row(0), level.stride(), octave.width, octave.height, e.x, e.y, e.sigma};
}

std::vector<Located> Oriented(const std::vector<Octave>& octaves, const std::vector<Located>& all,
                              int max_orientations) {
  std::vector<Located> oriented;
  for (const Located& l : all) {
    const PatchPosition patch = PatchOf(octaves[l.octave], *l.extremum);
    for (const float radians : Orientations(DirectionHistogram(patch), max_orientations)) {
      oriented.push_back(l);
      oriented.back().keypoint.orientation_rad = radians;
    }
  }
  return oriented;
}

Features Described(const std::vector<Octave>& octaves, const std::vector<Located>& all) {
  std::vector<size_t> order(all.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(),
            [&](size_t a, size_t b) { return IsLarger(all[a].keypoint, all[b].keypoint); });
  std::vector<size_t> rank(all.size());
  for (size_t i = 0; i < order.size(); ++i) rank[order[i]] = i;
  Features features;
  features.keypoints.resize(all.size());
  features.descriptors.resize(all.size());
  for (size_t i = 0; i < all.size(); ++i) {
    const PatchPosition patch = PatchOf(octaves[all[i].octave], *all[i].extremum);
    features.keypoints[rank[i]] = all[i].keypoint;
    features.descriptors[rank[i]] =
        StoredDescriptor(GradientCells(patch, all[i].keypoint.orientation_rad));
  }
  return features;
}

template <typename T>
Features Detect(std::span<const T> grey, Size photo, std::span<const std::uint8_t> mask,
                const SiftOptions& options) {
  Check(grey.size(), photo, mask.size(), options);
  const Size working = WorkingSize(photo, options);
  if (std::min(working.width, working.height) < kMinSidePx || options.max_features == 0) return {};
  const std::vector<Octave> octaves =
      Octaves(SourceImage(grey, photo.width, photo.height, working.width, working.height), working,
              options);
  const size_t count = static_cast<size_t>(options.max_features);
  std::vector<Located> located = LocatedIn(octaves, photo, working, mask);
  SortAndUnite(&located);
  located = Largest(std::move(located), count);
  return Described(octaves, Largest(Oriented(octaves, located, options.max_orientations), count));
}

}  // namespace

Features DetectSift(std::span<const std::uint8_t> grey, int width_px, int height_px,
                    std::span<const std::uint8_t> mask, const SiftOptions& options) {
  return Detect(grey, {width_px, height_px}, mask, options);
}

Features DetectSift(std::span<const float> grey, int width_px, int height_px,
                    std::span<const std::uint8_t> mask, const SiftOptions& options) {
  return Detect(grey, {width_px, height_px}, mask, options);
}

std::size_t SiftBytes(int width_px, int height_px, const SiftOptions& options) {
  const Size working = WorkingSize({width_px, height_px}, options);
  std::size_t bytes =
      RowStore::Values(working.width, working.height, working.height) * sizeof(float);
  Size octave{2 * working.width, 2 * working.height};
  for (int i = 0; i < OctaveCount(working, options); ++i) {
    bytes += OctaveBytes(octave.width, octave.height);
    octave = {octave.width / 2, octave.height / 2};
  }
  const std::size_t pixels =
      static_cast<size_t>(working.width) * static_cast<size_t>(working.height);
  return bytes + pixels / 8 * (2 * sizeof(Extremum) + 2 * sizeof(Located)) +
         static_cast<size_t>(options.max_features) *
             (4 * sizeof(Located) + sizeof(Keypoint) + sizeof(Descriptor) + 2 * sizeof(size_t)) +
         static_cast<size_t>(width_px) * (sizeof(float) + 4 * sizeof(int));
}

}  // namespace dtr::sfm
