// viewer/osg/input_view.h -- one depth image of a DepthTR, with what the founding report keeps of
// it (its section 3.2.1 and appendix III).
#pragma once
#include <osg/Vec3f>

#include <string>
#include <vector>

#include "dtr/render/options.h"
#include "dtr/render/result.h"
#include "dtr/types/grid.h"
#include "dtr/types/pose.h"
#include "dtr/types/view.h"

namespace osgDTR {

/// What one view alone shows of a novel camera.
struct ProjectedView {
  dtr::ImageRgb8 projectedImage;
  dtr::DepthImage projectedDepth;  ///< plane z in the novel camera; 0 at holes
  dtr::Mask holes;                 ///< 255 where this view shows nothing
  bool empty() const { return projectedImage.empty(); }
};

/// A triplet (D, I, C) and its place in the last novel view. Points at the set's view, which lives
/// as long as the DepthTR's scene.
class InputView {
 public:
  explicit InputView(const dtr::View& view) : view_(&view) {}

  const dtr::View& view() const { return *view_; }
  const std::string& name() const { return view_->name; }
  int width() const { return view_->camera.width_px(); }
  int height() const { return view_->camera.height_px(); }
  const dtr::PinholeCamera& calibration() const { return view_->camera; }
  Eigen::Vector3d cameraCenter() const { return view_->CenterInWorld(); }

  /// The 3D point of each pixel of the depth map in the set's world, row by row; (0, 0, 0) at
  /// holes.
  std::vector<osg::Vec3f> get3D() const;

  /// Draws this view alone as seen from a novel camera, by the reference renderer (dtr/cpu, two
  /// passes): the angle to the novel camera does not matter here. Throws as cpu::Render.
  void projectView(const dtr::PinholeCamera& novel, const dtr::Pose& novel_from_world,
                   dtr::RenderOptions options);
  const ProjectedView& projected() const { return projected_; }

  bool valid = false;  ///< for the last DepthTR::setNovelView
  double angle = 0;    ///< to the novel camera at the scene's centre, radians; for valid views
  double weight = 0;   ///< the view's share by that angle, after DepthTR::getNovelView

 private:
  friend class DepthTR;
  const dtr::View* view_;
  ProjectedView projected_;
};

}  // namespace osgDTR
