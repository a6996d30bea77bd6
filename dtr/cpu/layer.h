// dtr/cpu/layer.h -- one view drawn into a band of the novel image.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "dtr/render/adaptive_mesh.h"
#include "dtr/render/options.h"
#include "dtr/types/view.h"

namespace dtr::cpu {

/// Rows [first_row, first_row + rows) of the novel image.
struct Band {
  int width_px = 0, first_row = 0, rows = 0;
};

/// The nearest fragment of one view at each pixel of a band (SPEC 4.2), row-major.
struct Layer {
  explicit Layer(const Band& b)
      : band(b),
        inverse_depth(static_cast<size_t>(b.width_px) * static_cast<size_t>(b.rows), 0.0) {}

  Band band;
  std::vector<double> inverse_depth;  ///< 1/z in the novel camera, 1 / scene units; 0: no fragment
};

/// A view as seen from the novel camera.
struct ViewInNovel {
  const View* view = nullptr;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< novel_from_view
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();   ///< also the view's centre in novel
  double near_z = 0;  ///< triangles are cut here, SPEC 2.5; scene units
};

/// SPEC 2, 3 and 4.2: draws the view's samples as a mesh or as splats. Depends on nothing but its
/// arguments; work per sample is bounded by the size of the band.
Layer DrawView(const ViewInNovel& view_in_novel, const PinholeCamera& novel,
               const RenderOptions& options, const Band& band);

/// SPEC 5.1: the same of the view's reduced mesh.
Layer DrawReducedMesh(const ViewInNovel& view_in_novel, const AdaptiveMesh& mesh,
                      const PinholeCamera& novel, const RenderOptions& options, const Band& band);

}  // namespace dtr::cpu
