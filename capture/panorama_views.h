// capture/panorama_views.h -- the pixels of a panorama as a pinhole camera in its centre sees them.
#pragma once
#include "dtr/types/grid.h"
#include "dtr/types/panorama.h"

namespace dtr::capture {

/// What a view shows, and where the panorama has it (empty: everywhere).
struct PanoramaView {
  ImageRgb8 image;
  Mask mask;
};

/// The view of `camera`, turned as `cam_from_panorama` says, of `image` (sRGB, 8 bits) that
/// `panorama` describes. Catmull-Rom interpolation, averaged over as many samples of a pixel as it
/// covers pixels of the panorama (near the poles many), periodic across the back of a whole
/// panorama. `usable`: the panorama's own mask (empty: all). A pixel of the view is usable where
/// all that it is made of is; its colours are those of the nearest pixels elsewhere. The same bytes
/// for any number of threads.
PanoramaView ViewOfPanorama(const ImageRgb8& image, const Mask& usable, const Panorama& panorama,
                            const PinholeCamera& camera, const Eigen::Matrix3d& cam_from_panorama);

}  // namespace dtr::capture
