// viewer/osg/novel_camera.h -- OpenSceneGraph's matrices as the cameras of dtr/, and back.
#pragma once
#include <osg/Matrixd>

#include "dtr/gl/compositor.h"
#include "dtr/types/camera.h"
#include "dtr/types/pose.h"

namespace osgDTR {

/// A camera of OpenSceneGraph as seen from a node's own coordinates.
struct NovelCamera {
  dtr::PinholeCamera camera{1, 1, 1, 1, 0, 0};
  dtr::Pose cam_from_local;             ///< in the node's units
  dtr::gl::DepthProjection projection;  ///< of depths in the node's units
};

/// From OSG's matrices (row vectors: p_in_eye = p_in_local * modelview) and the viewport's size in
/// pixels. The modelview may turn, shift and scale alike along all axes.
/// Throws dtr::Error, one line, for what shows no image of a pinhole camera: mirrored or unevenly
/// scaled nodes, orthographic or skewed projections.
NovelCamera NovelCameraOf(const osg::Matrixd& modelview, const osg::Matrixd& projection,
                          int width_px, int height_px);

/// OSG's view matrix of a pose in the same world.
osg::Matrixd ViewMatrixOf(const dtr::Pose& cam_from_world);

/// OSG's projection matrix that makes images of this camera's size show what it sees.
osg::Matrixd ProjectionMatrixOf(const dtr::PinholeCamera& camera, double near_z, double far_z);

}  // namespace osgDTR
