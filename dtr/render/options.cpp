#include "dtr/render/options.h"

#include <cmath>
#include <string>

#include "dtr/base/error.h"

namespace dtr {
namespace {

void Require(bool holds, const std::string& flag, const std::string& expected, double found) {
  if (holds) return;
  throw UsageError(flag + ": expected " + expected + ", found " + std::to_string(found));
}

bool AtLeastZero(double value) { return value >= 0 && std::isfinite(value); }

}  // namespace

RenderOptions WholeFrames() {
  RenderOptions options;
  options.fill_holes = options.smooth_edges = true;
  return options;
}

void CheckRenderOptions(const RenderOptions& options) {
  Require(options.views >= 1, "`views`", "at least 1", options.views);
  Require(options.resolution >= 1, "`resolution`", "at least 1", options.resolution);
  Require(options.point_size > 0 && std::isfinite(options.point_size), "`point_size`",
          "a positive number", options.point_size);
  Require(AtLeastZero(options.exponent), "`exponent`", "0 or more", options.exponent);
  Require(AtLeastZero(options.falloff), "`falloff`", "0 or more", options.falloff);
  Require(options.blend_k >= 1, "`blend_k`", "at least 1", options.blend_k);
  Require(options.max_angle_rad > 0 && options.max_angle_rad <= std::numbers::pi, "`max_angle`",
          "more than 0 and at most 180 degrees", options.max_angle_rad * 180 / std::numbers::pi);
  Require(AtLeastZero(options.delta_px), "`delta`", "0 or more", options.delta_px);
  Require(AtLeastZero(options.depth_break_px), "`depth_break`", "0 or more",
          options.depth_break_px);
  Require(AtLeastZero(options.mesh_tolerance_px), "`mesh_tolerance`", "0 or more",
          options.mesh_tolerance_px);
  Require(AtLeastZero(options.absolute_delta.value_or(0)), "absolute delta", "0 or more",
          options.absolute_delta.value_or(0));
  Require(AtLeastZero(options.absolute_depth_break.value_or(0)), "absolute depth break",
          "0 or more", options.absolute_depth_break.value_or(0));
}

}  // namespace dtr
