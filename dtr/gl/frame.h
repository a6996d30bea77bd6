// dtr/gl/frame.h -- what one image is made of, as every pass sees it. Only dtr/gl's own files
// include this.
#pragma once
#include <vector>

#include "dtr/render/frame.h"
#include "dtr/render/options.h"
#include "dtr/render/scene.h"
#include "dtr/types/camera.h"

namespace dtr::gl {

/// One image: the views that take part, in canonical order.
struct Frame {
  const RenderScene& scene;
  const PinholeCamera& novel;
  const RenderOptions& options;
  bool per_pixel = false;     ///< SPEC 1.3
  bool on_processor = false;  ///< ProcessorResolver draws it
  std::vector<const View*> views;
  std::vector<ViewPlacement> placements;  ///< of the views
  std::vector<double> cut_factors;        ///< SPEC 1.4, of the views

  void Erase(size_t view) {
    const auto at = static_cast<std::ptrdiff_t>(view);
    views.erase(views.begin() + at);
    placements.erase(placements.begin() + at);
    cut_factors.erase(cut_factors.begin() + at);
  }
  bool deferred() const { return options.method == RenderMethod::kDeferred; }
};

/// Rows [first, first + count) of the image.
struct Band {
  int first = 0, count = 0;
};

}  // namespace dtr::gl
