// pipeline/core/cameras/point_conventions.h -- what a file's own points say of the conventions it
// was written in.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/foreign_scene.h"

namespace dtr::pipeline {

/// A camera of a file on its photo, and how pixels of the file become the photo's.
struct PlacedCamera {
  io::NamedCamera named;
  double scale_x = 1, scale_y = 1;  ///< photo pixels per pixel of the file
  Eigen::Vector2d shift{0, 0};      ///< added to pixels of the file before that
  bool y_up = false;                ///< y of the file's pixels is negated first

  Eigen::Vector2d PhotoPixel(const Eigen::Vector2d& pixel) const {
    return {(pixel.x() + shift.x()) * scale_x,
            ((y_up ? -pixel.y() : pixel.y()) + shift.y()) * scale_y};
  }
};

/// Index of cameras that have no photo here.
inline constexpr size_t kNotPlaced = ~size_t{0};

/// Programs write each other's formats by their own conventions. Projects the points of a file with
/// its cameras by each convention in use (pixels from the image's middle, its corner or the
/// principal point, y down or up; cameras that look along z or, with y up, along -z; distortion of
/// the measured or of the projected point, with either sign, per focal length or per pixel), and
/// takes the one that brings them to where the file says that photos show them. The format's own is
/// left only for one that is better beyond chance: the loss falls by more than 6 standard
/// deviations of its mean. Where pixels count from the corner, the principal point is taken from
/// them as well. `placed` becomes what was found; `place`: index into it of each camera of the
/// scene, or kNotPlaced. Returns one line where it is not the format's own, else "".
std::string SettleConventions(const io::ForeignScene& scene, const std::string& source,
                              const std::vector<size_t>& place, std::vector<PlacedCamera>& placed);

}  // namespace dtr::pipeline
