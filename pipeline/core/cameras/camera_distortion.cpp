#include "pipeline/core/cameras/camera_distortion.h"

#include <stdexcept>

#include "calib/lens_map.h"
#include "calib/undistort.h"
#include "dtr/base/error.h"

namespace dtr::pipeline {
namespace {

class LensDistortion final : public CameraDistortion {
 public:
  explicit LensDistortion(const io::NamedCamera& named)
      : lens_(CameraModelOf(named)), onto_(named.camera), map_(lens_) {}

  void Undistort(ImageRgb8& image, Mask& mask) const override {
    calib::UndistortedPhoto flat = calib::Undistort(image, mask, lens_, onto_, 0);
    image = std::move(flat.image);
    mask = std::move(flat.mask);
  }
  std::optional<Eigen::Vector2d> DistortedPixel(const Eigen::Vector2d& pixel) const override {
    return map_.PixelFromCam(onto_.RayFromPixel(pixel));
  }
  std::optional<Eigen::Vector3d> RayFromDistorted(const Eigen::Vector2d& pixel) const override {
    return map_.RayFromPixel(pixel);
  }

 private:
  calib::LensCamera lens_;
  PinholeCamera onto_;
  calib::LensMap map_;
};

}  // namespace

calib::LensCamera CameraModelOf(const io::NamedCamera& named) {
  const PinholeCamera& pinhole = named.camera;
  if (!named.distortion) {
    return {calib::CameraModel::kPinhole,
            pinhole.width_px(),
            pinhole.height_px(),
            {pinhole.fx_px(), pinhole.fy_px(), pinhole.cx_px(), pinhole.cy_px()}};
  }
  const auto model = calib::CameraModelFromName(named.distortion->model);
  if (!model) {
    throw Error(named.name + ": cannot be undistorted, no camera model is called " +
                named.distortion->model);
  }
  calib::LensCamera camera{*model, pinhole.width_px(), pinhole.height_px(),
                           named.distortion->params};
  try {
    camera.Check();
  } catch (const std::invalid_argument& error) {
    throw Error(named.name + ": camera: " + error.what());
  }
  return camera;
}

void SetCameraModel(io::NamedCamera& named, const calib::LensCamera& lens) {
  named.camera = lens.Pinhole();
  named.distortion.reset();
  if (!lens.IsUndistorted()) named.distortion = {calib::NameOf(lens.model), lens.params};
}

std::unique_ptr<CameraDistortion> DistortionOf(const io::NamedCamera& named) {
  return std::make_unique<LensDistortion>(named);
}

}  // namespace dtr::pipeline
