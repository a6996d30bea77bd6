// dtr/gl/frame.h -- what one picture is made of, as every pass sees it. Only dtr/gl's own files
// include this.
#pragma once
#include <vector>

#include "dtr/render/frame.h"
#include "dtr/render/options.h"
#include "dtr/render/scene.h"
#include "dtr/types/camera.h"

namespace dtr::gl {

/// One picture: the views that take part, in canonical order.
struct Frame {
  const RenderScene& scene;
  const PinholeCamera& novel;
  const RenderOptions& options;
  bool per_pixel = false;  ///< SPEC 1.3
  std::vector<const View*> views;
  std::vector<ViewPlacement> placements;  ///< of the views
  bool deferred() const { return options.method == RenderMethod::kDeferred; }
};

/// Rows [first, first + count) of the picture.
struct Band {
  int first = 0, count = 0;
};

}  // namespace dtr::gl
