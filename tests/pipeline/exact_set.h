// tests/pipeline/exact_set.h -- sets on disk whose surfaces are known exactly.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "datasets/exact/render_scenes.h"
#include "dtr/io/set_io.h"

namespace dtr::testing {

/// What an exported point may lie off in an image; half a pixel is 500 times it.
inline constexpr double kResidualPx = 1e-3;

/// A slanted plane behind a square: no depth of it is the same at two pixels.
inline Surface SlantedScene() {
  return Union(Square(0.3, -0.2, 5, 0.8), Plane(Eigen::Vector3d(0.3, -0.2, 1).normalized(), 9));
}

struct ExactSetOptions {
  int views = 5;
  double spacing = 0.5;  ///< of the cameras on a line
  int depth_scale = 1;
  double sigma_px = 0.1;  ///< of the stored sigma; 0: none
  LengthUnit unit = LengthUnit::kArbitrary;
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
  std::string validation_json = "{}";
  std::string provenance_json = "{}";
};

/// Its cameras differ a little from each other; their principal points are no image centres.
inline std::vector<View> ExactViews(const ExactSetOptions& options) {
  std::vector<View> views;
  for (int i = 0; i < options.views; ++i) {
    Shot shot =
        ShotFrom("v" + std::to_string(i),
                 {options.spacing * (i - 0.5 * (options.views - 1)), 0.1 * i, 0}, {0, 0, 9});
    shot.camera = PinholeCamera(96, 72, 100 + i, 101, 47.3, 36.9);
    shot.depth_scale = options.depth_scale;
    View view = Photograph(SlantedScene(), shot);
    view.name = "left/photo " + std::to_string(i) + ".JPG";
    view.reference_baseline = options.spacing;
    view.depth_coding = DepthCoding::kExrFloat;
    if (options.sigma_px > 0) {
      const double sigma = options.sigma_px / (shot.camera.fx_px() * options.spacing);
      view.inverse_depth_sigma =
          Grid<float>(view.depth.width(), view.depth.height(), 1, static_cast<float>(sigma));
    }
    views.push_back(std::move(view));
  }
  return views;
}

/// Writes the views as a set; they keep their pixels.
inline void WriteExactSet(const std::filesystem::path& folder, std::vector<View>& views,
                          const ExactSetOptions& options) {
  io::SetWriter writer(folder, R"({"test": 1})", false);
  DtrSet set;
  set.unit = options.unit;
  set.world_origin = options.world_origin;
  set.validation_json = options.validation_json;
  set.provenance_json = options.provenance_json;
  set.scene_center = {0, 0, 9};
  set.frames.resize(1);
  for (View& view : views) {
    writer.WriteView(view, set.unit);
    View listed = view;
    listed.image = {};
    listed.depth = {};
    listed.inverse_depth_sigma.reset();
    set.frames[0].views.push_back(std::move(listed));
  }
  writer.Finish(set);
}

}  // namespace dtr::testing
