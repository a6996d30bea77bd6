// dtr/render/frame.h -- the parts of drawing one image that every renderer has in common.
#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "dtr/render/options.h"
#include "dtr/render/result.h"
#include "dtr/render/scene.h"
#include "dtr/render/texture.h"
#include "dtr/render/valid_views.h"
#include "dtr/types/camera.h"
#include "dtr/types/pose.h"

namespace dtr {

/// Throws dtr::UsageError for images beyond 2^28 pixels and dtr::Error for a pose that is not
/// finite or has no rotation.
void CheckNovelCamera(const PinholeCamera& novel, const Pose& novel_from_world);

/// All grids of the novel camera's size: black, no depth, nothing seen.
RenderResult EmptyResult(const PinholeCamera& novel);

/// Share of pixels seen.
double CoverageShare(const Mask& coverage);

/// A view as seen from the novel camera.
struct ViewPlacement {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< novel_from_view
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();   ///< also the view's centre in novel
  double near_z = 0;   ///< triangles are cut here, SPEC 2.5; scene units
  Fading fading;       ///< SPEC 4.8; MakeFrame sets it
  double clipped = 0;  ///< SPEC 4.4 (ClippedOf); MakeFrame sets it
};

/// SPEC 0.5: from the difference of the centres, so that the world's offset cancels before anything
/// is multiplied.
ViewPlacement PlaceView(const View& view, const Pose& novel_from_world);

/// SPEC 4.8: how far the rendered image is from the view's own: the largest distance, in pixels of
/// its photo, between a corner of the image as the view sees it at the depth of the scene centre
/// and the same corner of the photo. Infinite where one is not in front of the view.
double CornersMovedPx(const View& view, const PinholeCamera& novel, const Pose& novel_from_world,
                      const Eigen::Vector3d& scene_center);

/// SPEC 4.7: `views`, indices into the scene, in the order in which sums run: that of the ids.
std::vector<int> CanonicalOrder(const RenderScene& scene, std::vector<int> views);

/// One rendered image as every pass of a fast renderer sees it: the views that take part, in
/// canonical order.
struct RenderFrame {
  const RenderScene& scene;
  const PinholeCamera& novel;
  const RenderOptions& options;
  bool per_pixel = false;  ///< SPEC 1.3
  std::vector<const View*> views;
  std::vector<ViewPlacement> placements;               ///< of the views
  std::vector<double> cut_factors;                     ///< SPEC 1.4, of the views
  Eigen::Vector3d exposure = Eigen::Vector3d::Ones();  ///< SPEC 4.9

  void EraseIf(const std::function<bool(const View&)>& leaves) {
    size_t kept = 0;
    for (size_t i = 0; i < views.size(); ++i) {
      if (leaves(*views[i])) continue;
      views[kept] = views[i];
      placements[kept] = placements[i];
      cut_factors[kept++] = cut_factors[i];
    }
    views.resize(kept);
    placements.resize(kept);
    cut_factors.resize(kept);
  }
  /// SPEC 4.4: some photo has clipped what is no white in this image.
  bool AnyClipped() const {
    return std::ranges::any_of(placements,
                               [](const ViewPlacement& placed) { return placed.clipped > 0; });
  }
  bool deferred() const { return options.method == RenderMethod::kDeferred; }
};

/// Of the selection's views; no cut factors yet. Nothing of its arguments is copied but the views.
RenderFrame MakeFrame(const RenderScene& scene, const PinholeCamera& novel,
                      const Pose& novel_from_world, const RenderOptions& options,
                      const ViewSelection& selection);

/// SPEC 1.4, where the `count` nearest of the selection's views are drawn.
void SetCutFactors(const ViewSelection& selection, size_t count, RenderFrame& frame);

/// Views of a selection, nearest first.
std::vector<const View*> NearestFirst(const RenderScene& scene, const ViewSelection& selection);

/// Rows [first, first + count) of a rendered image.
struct Band {
  int first = 0, count = 0;
};

/// SPEC 6: the band's rows of pixels of 4 bytes into those of `result`, which has the rendered
/// image's size; all but depth. `image`: RGBA, alpha 255 where seen; `marks`: views blended, 255 at
/// the Delta border, two unused.
void StoreRows(const Band& band, int width_px, const std::uint8_t* image, const std::uint8_t* marks,
               RenderResult& result);

}  // namespace dtr
