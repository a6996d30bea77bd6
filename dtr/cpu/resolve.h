// dtr/cpu/resolve.h -- SPEC 4: what the layers of all views say together, pixel by pixel.
#pragma once
#include <span>

#include "dtr/cpu/layer.h"
#include "dtr/render/blend_weights.h"
#include "dtr/render/result.h"
#include "dtr/render/texture.h"

namespace dtr::cpu {

/// What the resolve step needs to know about one view.
struct ResolveView {
  const ViewInNovel* in_novel = nullptr;
  const Layer* layer = nullptr;
  Eigen::Matrix3d view_from_novel_rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d view_from_novel_translation = Eigen::Vector3d::Zero();
  double delta_inverse_depth = 0;  ///< Delta of this view as a difference of 1/z
  double cut_factor = 1;           ///< SPEC 1.4
  Grid<std::uint8_t> rim_factors;  ///< SPEC 4.8
  Fading fading;                   ///< SPEC 4.8
  double clipped = 0;              ///< SPEC 4.4
};

/// What it needs to know about the image.
struct ResolveSettings {
  PinholeCamera novel{1, 1, 1, 1, 0, 0};
  BlendParameters blend;
  std::optional<double> absolute_delta;  ///< the report's Delta, scene units
  bool per_pixel_rule = false;           ///< SPEC 1.3: max_angle and `views` hold at the point
  int views = 8;
  bool linear_light = true;
};

/// Resolves row `y` of the image into `result`. The views must come in canonical order: sums run
/// in that order, so that the bits depend on nothing else.
/// With `shares`, a grid of the image's size per view, each is also told its share of the colour.
void ResolveRow(const ResolveSettings& settings, std::span<const ResolveView> views, int y,
                RenderResult& result, std::span<Grid<float>> shares = {});

}  // namespace dtr::cpu
