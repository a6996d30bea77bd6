// pipeline/core/cameras/camera_distortion.h -- undistortion of what `dtr import` reads.
#pragma once
#include <memory>

#include "calib/lens_camera.h"
#include "pipeline/import/detail/import_views.h"

namespace dtr::pipeline {

/// The camera with its distortion. Throws Error for a model that is not known, or parameters that
/// cannot be.
calib::LensCamera CameraModelOf(const io::NamedCamera& named);

/// The reverse: gives `named` this camera.
void SetCameraModel(io::NamedCamera& named, const calib::LensCamera& lens);

/// For ImportOptions::distortion_of. Throws as CameraModelOf.
std::unique_ptr<CameraDistortion> DistortionOf(const io::NamedCamera& named);

}  // namespace dtr::pipeline
