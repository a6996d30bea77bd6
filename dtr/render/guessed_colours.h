// dtr/render/guessed_colours.h -- SPEC 7.2: what the views show where no surface was measured.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "dtr/render/blend_weights.h"
#include "dtr/render/exposure.h"
#include "dtr/render/guess_kernel.h"
#include "dtr/render/options.h"
#include "dtr/render/scene.h"
#include "dtr/types/camera.h"
#include "dtr/types/grid.h"
#include "dtr/types/pose.h"

namespace dtr {

/// The views of one image, asked pixel by pixel. The views must outlive it.
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
    double fade_width_px;                                ///< SPEC 7.4
    Eigen::Vector3d exposure = Eigen::Vector3d::Ones();  ///< as Exposed takes it
    std::array<std::array<double, 256>, 3> linear{};     ///< of the photo's values: LinearAfterGain
  };
  /// SPEC 7.4: the views in the image's exposure from here on. `seen`: plane z, 0 at holes;
  /// `image`: the image.
  void MatchExposures(const Grid<float>& seen, const ImageRgb8& image, int threads);

  /// In the order of the ids.
  const std::vector<Placed>& views() const { return views_; }
  const PinholeCamera& novel() const { return novel_; }

  /// Answers for the pixels of one row. One per thread: it holds what pixels need while they are
  /// worked on.
  class Row {
   public:
    Row(const GuessedColours& guesses, int y);

    struct Hole {
      int x;
      double farthest, nearest;  ///< inverse depths, above 0
    };
    /// Of some inverse depths in each hole's range the nearest that no view sees through; 0 where
    /// no view shows anything there.
    const std::vector<double>& DepthsOf(std::span<const Hole> holes);

    struct Point {
      int x;
      double inverse_depth;
    };
    /// The colours that the views show at points, linear light; empty where none shows any.
    const std::vector<std::optional<Eigen::Vector3d>>& ColoursAt(std::span<const Point> points);

   private:
    bool AnyUsable(size_t lane) const;
    void AskColours(size_t count);
    void Share();

    const GuessedColours& guesses_;
    const GuessRow row_;
    std::vector<GuessView> views_;
    size_t sceptic_ = 0;  ///< as FindGuesses has it: likely the next pixels' too
    GuessAnswers answers_;
    std::vector<double> depths_, angles_, shares_;
    std::vector<std::optional<Eigen::Vector3d>> colours_;
  };

 private:
  const PinholeCamera novel_;
  const BlendParameters blend_;
  std::vector<Placed> views_;  ///< in the order of the ids
};

}  // namespace dtr
