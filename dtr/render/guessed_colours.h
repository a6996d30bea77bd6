// dtr/render/guessed_colours.h -- SPEC 7.2: what the views show where no surface was measured.
#pragma once
#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <vector>

#include "dtr/render/blend_weights.h"
#include "dtr/render/options.h"
#include "dtr/render/scene.h"
#include "dtr/types/camera.h"
#include "dtr/types/grid.h"
#include "dtr/types/pose.h"

namespace dtr {

/// Linear light in [0, 1] in another exposure: times `exposure` (above 0) in the dark, bent so that
/// white stays white, for what a photo clipped is as bright in any. Rising; 1 / exposure undoes it.
inline double Exposed(double linear, double exposure) {
  const auto fourth = [](double v) { return v * v * v * v; };
  return exposure * linear / std::sqrt(std::sqrt(1 + (fourth(exposure) - 1) * fourth(linear)));
}

/// A colour for a pixel that no view saw, and the inverse depth it was found at.
struct GuessedColour {
  Eigen::Vector3d linear_rgb;
  double inverse_depth = 0;  ///< plane z of the novel camera
};

/// The views of one picture, asked pixel by pixel. The views must outlive it.
class GuessedColours {
 public:
  /// Asks the first K of `views_used` (indices into the scene, nearest first).
  GuessedColours(const RenderScene& scene, const std::vector<int>& views_used,
                 const PinholeCamera& novel, const Pose& novel_from_world,
                 const RenderOptions& options);

  /// A view and where it stands.
  struct Placed {
    const View* view;
    Eigen::Matrix3d pixel_from_novel_pixel;   ///< homogeneous pixel of the view, of a point at
    Eigen::Vector3d pixel_per_inverse_depth;  ///< infinity, and what 1/z adds to it
    Eigen::Vector3d center_in_novel;
    double delta_inverse_depth;
    Eigen::Vector3d exposure = Eigen::Vector3d::Ones();  ///< as Exposed takes it
  };
  /// SPEC 7.4: the views in the picture's exposure from here on. `seen`: plane z, 0 at holes;
  /// `image`: the picture.
  void MatchExposures(const Grid<float>& seen, const ImageRgb8& image);

  /// In the order of the ids.
  const std::vector<Placed>& views() const { return views_; }
  const PinholeCamera& novel() const { return novel_; }

  /// Answers for the pixels of one row. One per thread: it holds what a pixel needs while it is
  /// worked on.
  class Row {
   public:
    Row(const GuessedColours& guesses, int y);
    /// Of some inverse depths from `nearest` to `farthest` (both above 0) the nearest that no view
    /// sees through; the colour that the views show there. Empty where none of them shows any.
    std::optional<GuessedColour> At(int x, double farthest, double nearest);

   private:
    /// A view's line of homogeneous pixels p + w k along this row, and what it says of a guess.
    struct Asked {
      Eigen::Vector3d pixel_per_x, pixel_at_0;
      Eigen::Vector2d pixel;
      bool answers = false;
    };
    bool Ask(int x, double inverse_depth, bool despite_what_is_seen);
    std::optional<Eigen::Vector3d> Blend(int x, double inverse_depth);

    const GuessedColours& guesses_;
    int y_;
    std::vector<Asked> asked_;
    size_t sceptic_ = 0;  ///< the view that saw through a guess last: likely the next one's too
    std::vector<double> dots_, angles_, shares_, fades_;
    std::vector<Eigen::Vector3d> colours_;
  };

 private:
  const PinholeCamera novel_;
  const BlendParameters blend_;
  std::vector<Placed> views_;  ///< in the order of the ids
};

}  // namespace dtr
