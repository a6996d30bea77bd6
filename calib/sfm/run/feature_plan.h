// calib/sfm/run/feature_plan.h -- feature extraction within a memory limit, camera by camera.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/lens_camera.h"
#include "calib/sfm/run/sfm.h"

namespace dtr::sfm {

/// How features are extracted so that memory suffices.
struct ExtractionPlan {
  int threads = 1;
  int max_image_size_px = 0;  ///< long side; larger photos are scaled down for features only
  double expected_peak_gib = 0;
  int max_features = 0;  ///< per photo; 0: COLMAP's own limit
};

/// Model of COLMAP's CPU extraction (VLFeat SIFT from octave -1, that is, on the doubled image):
/// 290 bytes per pixel and thread for the scale space, that is 18 float planes of 4 pixels per
/// pixel, and a part that does not scale. Measured on 6 Mpx photos with COLMAP 3.8, one thread:
/// 623 MiB at 1600 px, 1315 MiB at 2400 px, which is 302 bytes per pixel and 69 MiB.
inline constexpr double kBytesPerPixelAndThread = 310;
inline constexpr double kBaseMib = 100;
/// Decoded photos wait in COLMAP's queues, about one per thread and one more; RGB.
inline constexpr double kQueueBytesPerPixel = 3;
/// Share of the limit the plan fills; the rest is for what the model does not know.
inline constexpr double kFill = 0.9;
/// Long side used when the memory allows and nothing else is asked.
inline constexpr int kPreferredSidePx = 2400;
/// Below this long side features no longer tell photos apart; less memory is rejected.
inline constexpr int kSmallestSidePx = 640;

/// Chooses threads and size: the size first (`requested_side_px`, or kPreferredSidePx when 0), then
/// as many of `threads` as fit; when not even one fits, the largest size at which one does.
/// Throws UsageError when memory_gb does not suffice for kSmallestSidePx.
ExtractionPlan PlanExtraction(const std::vector<SfmImageInput>& images, double memory_gb,
                              int requested_side_px);

/// Photos that share one camera of the database.
struct CameraGroup {
  std::vector<size_t> images;  ///< indices into Workspace::images(), rising
  calib::CameraModel model = calib::CameraModel::kSimpleRadial;
  std::vector<double> params;              ///< a good first guess, or empty: COLMAP guesses
  std::optional<std::uint32_t> camera_id;  ///< of the database, when it holds the camera already
};

/// Groups by camera_group and size (every photo alone when not `share`), in the order of the first
/// photo's name. The guess is the median focal prior of the group, no distortion; a known lens is
/// taken as it is.
std::vector<CameraGroup> GroupCameras(const std::vector<SfmImageInput>& images,
                                      calib::CameraModel model, bool share);

/// Parameters of a lens with this focal length, its principal point in the middle, no distortion.
std::vector<double> FirstGuess(calib::CameraModel model, const SfmImageInput& image,
                               double focal_px);

/// COLMAP's text of camera parameters: exact decimals separated by commas.
std::string ParamsText(const std::vector<double>& params);

/// Photos after which features are safe from an interruption, at first: a minute or two of work.
inline constexpr size_t kPhotosPerBatch = 48;

/// Every camera has a focal length of EXIF to be fixed at.
bool AllHavePriors(const std::vector<CameraGroup>& groups);

/// Numbers of two photos, a < b; sorted.
using ImagePairs = std::vector<std::pair<size_t, size_t>>;

/// kAuto resolved for a number of photos; other values unchanged.
Matching ResolveMatching(Matching matching, size_t images);

}  // namespace dtr::sfm
