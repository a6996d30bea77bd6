// calib/models/board_model.h -- the lens models that board calibration chooses between.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/lens_camera.h"

namespace dtr::calib {

/// Lens models by the coefficients that are estimated. The perspective ones are nested: each has
/// the parameters of the one before, and further ones (OpenCV's order).
enum class BoardModel {
  kPinhole,  ///< fx, fy, cx, cy
  kBrown4,   ///< ... k1, k2, p1, p2 (Brown 1966, Conrady 1919)
  kBrown5,   ///< ... k3
  kBrown8,   ///< ... k4, k5, k6 in the denominator
  kFisheye,  ///< fx, fy, cx, cy, k1 to k4 of the angle (Kannala & Brandt 2006)
};

inline constexpr BoardModel kBoardModels[] = {BoardModel::kPinhole, BoardModel::kBrown4,
                                              BoardModel::kBrown5, BoardModel::kBrown8,
                                              BoardModel::kFisheye};
inline constexpr int kMaxLensParameters = 12;  ///< of brown8

/// "pinhole", "brown4", ...
std::string NameOf(BoardModel model);
std::optional<BoardModel> BoardModelFromName(const std::string& name);

/// The model as LensCamera stores it; brown5 is FULL_OPENCV with k4 = k5 = k6 = 0.
CameraModel CameraModelOf(BoardModel model);
/// How many of that CameraModel's parameters, the first ones, are estimated. The others are zero.
int FreeParameterCount(BoardModel model);
/// Order of simplicity: how far a model can bend where no corner holds it. Perspective models come
/// first, by their radial terms; a fisheye has four of them; of a quotient the denominator can
/// vanish.
int ComplexityOf(BoardModel model);
/// Names of the estimated parameters: "fx_px", "fy_px", "cx_px", "cy_px", "k1", ...
std::vector<std::string> FreeParameterNames(BoardModel model);

/// A camera of this model with these estimated parameters.
/// Throws std::invalid_argument as LensCamera::Check does, or on another number of parameters.
LensCamera CameraFrom(BoardModel model, int width_px, int height_px,
                      std::span<const double> free_params);

/// True where every pixel that matters has a ray, and one only: the distortion grows up to the
/// farthest corner of the image. A fisheye's image may be a circle with nothing in the corners: of
/// it the largest circle around the principal point that stays in the image is asked for. Beyond
/// the corners that were observed a polynomial can turn back inside the image, and then some of its
/// pixels mean nothing.
bool CoversImage(const LensCamera& camera);
/// Whether CoversImage asks for this pixel: of a fisheye what lies in that circle, else all.
bool IsAskedFor(const LensCamera& camera, const Eigen::Vector2d& pixel);

}  // namespace dtr::calib
