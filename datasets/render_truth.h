// datasets/render_truth.h -- photos, exact depth and truth masks of a synthetic scene.
#pragma once
#include <cstdint>
#include <vector>

#include "datasets/scene.h"
#include "dtr/types/camera.h"
#include "dtr/types/depth_image.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/grid.h"
#include "dtr/types/pose.h"

namespace dtr::datasets {

/// Radial lens distortion (Brown 1971; COLMAP's RADIAL): with x, y = ray / z and r^2 = x^2 + y^2,
/// pixel = principal point + focal * (1 + k1 r^2 + k2 r^4) * (x, y). Of a fisheye (Kannala & Brandt
/// 2006; COLMAP's RADIAL_FISHEYE) (x, y) has the ray's direction and r is its angle.
struct RadialLens {
  double k1 = 0, k2 = 0;
  bool fisheye = false;
  bool IsIdeal() const { return k1 == 0 && k2 == 0 && !fisheye; }
};

/// How a photo is taken.
struct PhotoOptions {
  int supersampling = 3;   ///< n: n x n samples per pixel on a regular grid, box-filtered
  double noise_sigma = 0;  ///< std. deviation of Gaussian noise, 8-bit sRGB levels
  double gain = 1;         ///< exposure: factor on linear light
  RadialLens lens;
  std::uint64_t seed = 0;  ///< of the noise; give every view its own
};

/// Throws UsageError for options out of range, or a lens that folds over inside the image, or a
/// fisheye of 360 degrees and more.
void CheckPhotoOptions(const PinholeCamera& camera, const PhotoOptions& options);

/// Linear light that reaches each pixel, shape (height, width, 3), before exposure and noise: the
/// box-filtered mean of n x n radiances. `gain`, `noise_sigma` and `seed` play no part.
/// Throws as CheckPhotoOptions.
Grid<float> RenderLight(const Scene& scene, const PinholeCamera& camera, const Pose& cam_from_world,
                        const PhotoOptions& options);

/// The same of a whole equirectangular panorama (dtr/types/panorama.h) of width_px x width_px / 2
/// around the centre of `cam_from_world`, whose z axis is in its middle: n x n samples per pixel on
/// a regular grid of longitude and latitude. options.lens plays no part. Throws as
/// CheckPhotoOptions, and std::invalid_argument for an odd width.
Grid<float> RenderPanoramaLight(const Scene& scene, int width_px, const Pose& cam_from_world,
                                const PhotoOptions& options);

/// The photo of that light: exposure, clipping at white, the sRGB transfer function of
/// IEC 61966-2-1, noise, rounding to 8 bits.
ImageRgb8 Develop(const Grid<float>& light, const PhotoOptions& options);

/// What `camera`, standing at cam_from_world, photographs: RenderLight, then Develop.
/// Rays that hit nothing are black.
ImageRgb8 RenderPhoto(const Scene& scene, const PinholeCamera& camera, const Pose& cam_from_world,
                      const PhotoOptions& options);

/// Plane z at pixel centres (one ray each, no antialiasing), multiplied by `scale` before it is
/// rounded to float. Rays that hit nothing are holes.
DepthImage RenderDepth(const Scene& scene, const PinholeCamera& camera, const Pose& cam_from_world,
                       double scale = 1);

/// 255 where the surface point seen at the pixel's centre is seen by at least `min_others` of
/// `others`: inside the image, on the same side of the surface, nothing in between. By ray casting,
/// no depth tolerance involved.
Mask VisibilityMask(const Scene& scene, const PinholeCamera& camera, const Pose& cam_from_world,
                    const std::vector<Pose>& others, int min_others = 2);

/// 255 where the photo has texture: the standard deviation of its luma (BT.601) over the 9x9 pixels
/// around (fewer at the border) is at least 4 levels.
Mask TextureMask(const ImageRgb8& photo);

/// The set these cameras would give if nothing had to be estimated: one frame whose views have
/// photo, depth, camera and pose, ids "0000"..., names "0000.jpg"..., near_z and far_z from the
/// depth, centre, bounds and baselines as for every other set. View i's noise comes from
/// HashOf(options.seed, i).
DtrSet RenderTruthSet(const Scene& scene, const PinholeCamera& camera,
                      const std::vector<Pose>& cams_from_world, const PhotoOptions& options = {});

}  // namespace dtr::datasets
