// tests/cli/small_courtyard.h -- tiny exact photos with a COLMAP model of their true cameras.
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "calib/sfm_model.h"
#include "dtr/types/camera.h"
#include "dtr/types/pose.h"

namespace dtr::testing {

inline constexpr int kCourtyardViews = 7;
inline constexpr int kCourtyardWidthPx = 192, kCourtyardHeightPx = 128;

/// Makes `folder` with what MakeDataset writes (images/0000.jpg ..., cameras.json, depth/) and
/// sparse/, a COLMAP model of the true cameras and exact points that at least two of them see: a
/// calibration that needs no program to be found. The written world is scale * scene + offset.
void MakeSmallCourtyard(const std::filesystem::path& folder, double scale = 1,
                        const Eigen::Vector3d& offset = Eigen::Vector3d::Zero());

/// A photo of the courtyard: by which camera and from where, in the scene's own frame.
struct CourtyardPhoto {
  std::string name;
  PinholeCamera camera;
  Pose cam_from_scene;
};

/// Poses of the courtyard's arc.
std::vector<Pose> CourtyardArc(int views);

/// Renders the photos below `folder`, by their names.
void RenderCourtyard(const std::filesystem::path& folder,
                     const std::vector<CourtyardPhoto>& photos);

/// The true cameras of these photos, and exact points that at least two of them see, as a COLMAP
/// model; photos with equal cameras share one. The written world is scale * scene + offset.
calib::SfmModel CourtyardModel(const std::vector<CourtyardPhoto>& photos, double scale = 1,
                               const Eigen::Vector3d& offset = Eigen::Vector3d::Zero());

/// Names a model's images 000000.jpg, 000001.jpg, ..., as COLMAP gets them, and returns the names.
std::vector<std::string> NumberImages(calib::SfmModel& model);

/// Replaces a photo by another image of the same size.
void ChangePhoto(const std::filesystem::path& photo);

}  // namespace dtr::testing
