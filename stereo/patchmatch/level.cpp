#include "stereo/patchmatch/level.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "dtr/base/error.h"

namespace dtr::stereo::patchmatch {
namespace {

/// Binary digits of a camera's place relative to another's.
constexpr double kGapBits = 18;

Texture MakeTexture(const GreyImage& picture) {
  Texture t;
  t.width = picture.grey.width();
  t.height = picture.grey.height();
  t.stride = t.width + 2 * kTextureBorder;
  const int rows = t.height + 2 * kTextureBorder;
  t.quads.resize(static_cast<size_t>(t.stride) * static_cast<size_t>(rows));
  const auto at = [&](int x, int y) {
    const float grey = picture.grey(std::clamp(x, 0, t.width - 1), std::clamp(y, 0, t.height - 1));
    return static_cast<std::uint32_t>(std::clamp(grey + 0.5f, 0.0f, 255.0f));
  };
  size_t n = 0;
  for (int y = -kTextureBorder; y < t.height + kTextureBorder; ++y) {
    for (int x = -kTextureBorder; x < t.width + kTextureBorder; ++x) {
      t.quads[n++] = at(x, y) | at(x + 1, y) << 8 | at(x, y + 1) << 16 | at(x + 1, y + 1) << 24;
    }
  }
  const auto& usable = picture.usable.data();
  if (std::count(usable.begin(), usable.end(), 0) > 0) t.usable = picture.usable;
  return t;
}

Eigen::Matrix3d MatrixOf(const PinholeCamera& camera) {
  Eigen::Matrix3d k;
  k << camera.fx_px(), 0, camera.cx_px(), 0, camera.fy_px(), camera.cy_px(), 0, 0, 1;
  return k;
}

/// From the other camera's centre to the view's, in units of `unit`. From centres, so that an
/// offset of the world cancels before anything is multiplied by it; and in steps of less than 1e-5
/// of its length: at 1e7 from the origin doubles carry noise of 1e-9, and noise of any size sends a
/// random search other ways.
Eigen::Vector3d GapBetween(const StereoView& view, const StereoView& other, double unit) {
  const Eigen::Vector3d gap =
      (view.cam_from_world.TargetOriginInSource() - other.cam_from_world.TargetOriginInSource()) /
      unit;
  if (!(gap.norm() > 0)) return gap;
  const double step = std::exp2(std::round(std::log2(gap.norm())) - kGapBits);
  return (gap / step).array().round() * step;
}

/// False for images of so few colours that every texture is made of them: line art, thresholded
/// scans. There a window's weights by colour would leave one colour of it, and no texture.
/// What a mask hides has no say.
bool ColoursTellSurfacesApart(const StereoView& view) {
  constexpr size_t kFewColours = 4;
  const ImageRgb8& image = *view.image;
  const bool masked = view.mask != nullptr && !view.mask->empty();
  std::array<std::array<std::uint8_t, 3>, kFewColours> seen{};
  size_t count = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (masked && (*view.mask)(x, y) == 0) continue;
      const std::array<std::uint8_t, 3> colour{image(x, y, 0), image(x, y, 1), image(x, y, 2)};
      const auto end = seen.begin() + static_cast<std::ptrdiff_t>(count);
      if (std::find(seen.begin(), end, colour) != end) continue;
      if (count == kFewColours) return true;  // photos end here within a few pixels
      seen[count++] = colour;
    }
  }
  return false;
}

/// Colours of a photo shrunk to blocks of `side` pixels: the mean of those its mask allows.
Bordered<std::int32_t> ColourOf(const StereoView& view, int width, int height, int side) {
  const ImageRgb8& image = *view.image;
  const bool masked = view.mask != nullptr && !view.mask->empty();
  Bordered<std::int32_t> colour(width, height, 0);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      int sum[3] = {}, count = 0;
      for (int j = side * y; j < side * (y + 1); ++j) {
        for (int i = side * x; i < side * (x + 1); ++i) {
          if (masked && (*view.mask)(i, j) == 0) continue;
          for (int c = 0; c < 3; ++c) sum[c] += image(i, j, c);
          ++count;
        }
      }
      std::int32_t packed = 0;
      for (int c = 0; c < 3 && count > 0; ++c) packed |= (sum[c] + count / 2) / count << (8 * c);
      *colour.at(x, y) = packed;
    }
  }
  return colour;
}

}  // namespace

std::vector<GreyImage> Pyramid(GreyImage full, int levels) {
  std::vector<GreyImage> pictures;
  pictures.push_back(std::move(full));
  while (static_cast<int>(pictures.size()) < levels) pictures.push_back(Halved(pictures.back()));
  return pictures;
}

SourcePyramid MakeSource(const StereoView& view, int levels) {
  if (view.camera.width_px() > kWidestTexture) {
    throw Error("patchmatch: expected photos at most " + std::to_string(kWidestTexture) +
                " pixels wide, found " + std::to_string(view.camera.width_px()) +
                "; shrink them (`max_size`)");
  }
  SourcePyramid source;
  source.view = &view;
  for (const GreyImage& picture : Pyramid(MakeGreyImage(view), levels)) {
    source.cameras.push_back(picture.camera);
    source.textures.push_back(MakeTexture(picture));
  }
  return source;
}

Level MakeLevel(const StereoView& view, const GreyImage& reference,
                std::span<const SourcePyramid> sources, size_t index, const DepthRange& range,
                std::uint64_t seed) {
  Level level;
  level.w_min = static_cast<float>(range.near_z / range.far_z);
  level.w_max = 1.0f;
  level.seed = seed;
  Reference& r = level.reference;
  r.width = reference.grey.width();
  r.height = reference.grey.height();
  r.grey = BorderedGrid(r.width, r.height, 0);
  r.usable = BorderedGrid(r.width, r.height, 0);
  for (int y = 0; y < r.height; ++y) {
    std::copy_n(reference.grey.row(y), r.width, r.grey.at(0, y));
    for (int x = 0; x < r.width; ++x) *r.usable.at(x, y) = reference.usable(x, y) != 0 ? 1 : 0;
  }
  r.rgb = ColoursTellSurfacesApart(view) ? ColourOf(view, r.width, r.height, 1 << index)
                                         : Bordered<std::int32_t>(r.width, r.height, 0);
  const Eigen::Matrix3d reference_inverse = MatrixOf(reference.camera).inverse();
  // Texture index coordinates: pixel centre i + 0.5 lies at i + kTextureBorder.
  Eigen::Matrix3d shift = Eigen::Matrix3d::Identity();
  shift(0, 2) = shift(1, 2) = kTextureBorder - 0.5;
  for (const SourcePyramid& s : sources) {
    const Eigen::Vector3d t =
        s.view->cam_from_world.rotation * GapBetween(view, *s.view, range.near_z);
    const Eigen::Matrix3d rotation =
        (s.view->cam_from_world.rotation * view.cam_from_world.rotation.conjugate())
            .toRotationMatrix();
    const Eigen::Matrix3d project = shift * MatrixOf(s.cameras[index]);
    const Eigen::Matrix3d m = project * rotation * reference_inverse;
    const Eigen::Vector3d k = project * t;
    const Eigen::Matrix3d unproject = project.inverse();
    const Eigen::Matrix3d back = MatrixOf(reference.camera) * rotation.transpose();
    const Eigen::Matrix3d back_m = back * unproject;
    const Eigen::Vector3d back_k = -back * t;
    Source source;
    source.texture = &s.textures[index];
    source.surface = index == 0 ? s.surface : nullptr;
    if (source.surface != nullptr) {
      source.surface_scale = static_cast<float>(range.near_z / source.surface->unit_z);
    }
    for (int i = 0; i < 9; ++i) source.m[i] = static_cast<float>(m(i / 3, i % 3));
    for (int i = 0; i < 3; ++i) source.k[i] = static_cast<float>(k(i));
    for (int i = 0; i < 9; ++i) source.back_m[i] = static_cast<float>(back_m(i / 3, i % 3));
    for (int i = 0; i < 3; ++i) source.back_k[i] = static_cast<float>(back_k(i));
    level.sources.push_back(source);
  }
  return level;
}

State EmptyState(const Level& level) {
  const int w = level.reference.width, h = level.reference.height;
  State state;
  state.w = BorderedGrid(w, h, level.w_min);
  state.a = state.b = BorderedGrid(w, h, 0);
  state.cost = BorderedGrid(w, h, std::numeric_limits<float>::infinity());
  const float equal = 1.0f / static_cast<float>(level.sources.size());
  state.weight.assign(level.sources.size(), BorderedGrid(w, h, equal));
  return state;
}

PlaneMap PlanesOf(const Level& level, const State& state, const DepthRange& range) {
  const int w = level.reference.width, h = level.reference.height;
  PlaneMap map{Grid<float>(w, h), Grid<float>(w, h), Grid<float>(w, h), range.near_z};
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      map.inverse_depth(x, y) = *state.w.at(x, y);
      map.slope_x(x, y) = *state.a.at(x, y);
      map.slope_y(x, y) = *state.b.at(x, y);
    }
  }
  return map;
}

State StateOf(const Level& level, const PlaneMap& map, const DepthRange& range) {
  State state = EmptyState(level);
  const auto scale = static_cast<float>(range.near_z / map.unit_z);
  for (int y = 0; y < level.reference.height; ++y) {
    for (int x = 0; x < level.reference.width; ++x) {
      *state.w.at(x, y) = std::clamp(scale * map.inverse_depth(x, y), level.w_min, level.w_max);
      *state.a.at(x, y) = scale * map.slope_x(x, y);
      *state.b.at(x, y) = scale * map.slope_y(x, y);
      *state.cost.at(x, y) = kWorstCost;
    }
  }
  return state;
}

BorderedGrid OpenPixels(const Level& level, const Mask& open, int side) {
  const int w = level.reference.width, h = level.reference.height;
  BorderedGrid pixels(w, h, 0);
  for (int y = 0; y < open.height(); ++y) {
    const int level_y = std::min(y / side, h - 1);
    for (int x = 0; x < open.width(); ++x) {
      if (open(x, y) != 0) *pixels.at(std::min(x / side, w - 1), level_y) = 1;
    }
  }
  return pixels;
}

State::Hypothesis HypothesisOf(const Level& level, const PlaneMap& map, const DepthRange& range) {
  const int width = level.reference.width, height = level.reference.height;
  const BorderedGrid none(width, height, 0);
  State::Hypothesis hypothesis{none, none, none};
  const auto scale = static_cast<float>(range.near_z / map.unit_z);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      *hypothesis.w.at(x, y) = scale * map.inverse_depth(x, y);
      *hypothesis.a.at(x, y) = scale * map.slope_x(x, y);
      *hypothesis.b.at(x, y) = scale * map.slope_y(x, y);
    }
  }
  return hypothesis;
}

State Upsampled(const State& coarse, const Level& coarse_level, const Level& level) {
  State state = EmptyState(level);
  for (int y = 0; y < level.reference.height; ++y) {
    const int yc = std::min(y / 2, coarse_level.reference.height - 1);
    const float dy = 0.5f * (static_cast<float>(y) + 0.5f) - (static_cast<float>(yc) + 0.5f);
    for (int x = 0; x < level.reference.width; ++x) {
      const int xc = std::min(x / 2, coarse_level.reference.width - 1);
      const float dx = 0.5f * (static_cast<float>(x) + 0.5f) - (static_cast<float>(xc) + 0.5f);
      const float a = *coarse.a.at(xc, yc), b = *coarse.b.at(xc, yc);
      *state.w.at(x, y) =
          std::clamp(*coarse.w.at(xc, yc) + a * dx + b * dy, level.w_min, level.w_max);
      *state.a.at(x, y) = 0.5f * a;
      *state.b.at(x, y) = 0.5f * b;
      *state.cost.at(x, y) = *coarse.cost.at(xc, yc);
      for (size_t v = 0; v < state.weight.size(); ++v) {
        *state.weight[v].at(x, y) = *coarse.weight[v].at(xc, yc);
      }
    }
  }
  return state;
}

}  // namespace dtr::stereo::patchmatch
