// capture/image_circle.h -- whether photos show a circle on black, as a fisheye throws it.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/photo.h"

namespace dtr::capture {

/// A circle that all images fill and none exceeds, in pixels of the thumbnails (Screening).
struct ImageCircle {
  Eigen::Vector2d centre;  ///< pixel centres at + 0.5
  double radius = 0;
};

/// The circle outside of which all of these images, of one size, are black, and to which some are
/// bright. Empty where there is none: vignetting is not black, what stands before black is no
/// circle, and one that lies off the middle or is small is not the image's.
std::optional<ImageCircle> ImageCircleOf(std::span<const Grid<std::uint16_t>* const> thumbnails);

/// One line where the photos of some camera show such a circle and no mask hides the rest; ""
/// otherwise. Photos without a thumbnail are not looked at.
std::string LineOfImageCircle(const std::vector<Photo>& photos);

}  // namespace dtr::capture
