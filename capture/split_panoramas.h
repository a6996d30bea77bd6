// capture/split_panoramas.h -- 360 degree panoramas become pinhole views, as photos of a rig.
#pragma once
#include <filesystem>

#include "capture/photo.h"
#include "dtr/base/progress.h"
#include "dtr/types/panorama.h"

namespace dtr::capture {

/// Which photos are taken for equirectangular panoramas.
enum class PanoramaUse {
  kAuto,    ///< those whose XMP says so (GPano:ProjectionType), frames whose video does
  kAlways,  ///< all; each must be twice as wide as high, or state which part it is
  kNever,   ///< none
};

/// Whether the photos are panoramas to be split. With kAuto, where fewer than half as many photos
/// are of one kind as of the other, these are moved to `capture.skipped`, and `progress` has a
/// note. Throws Error where some are panoramas and about as many are not, and where one's size is
/// not that of an equirectangular panorama. Adds remarks where photos are twice as wide as high, or
/// state another projection, and are taken as they are.
bool ArePanoramas(Capture& capture, PanoramaUse use, Progress* progress = nullptr);

/// The sphere around a photo. Throws Error naming the photo where its size does not fit.
Panorama PanoramaOf(const Photo& photo);

/// The photos' views, as photos "FACE/ID.jpg" (JPEG of quality 98 in `folder`, which must be new or
/// empty) with Photo::face: ID is the panorama's. All views have one size, that of the widest
/// panorama (FaceSizePx). Masks and alpha of a panorama are split with it; a view that has no
/// usable pixel is left out and listed. What screening said of a panorama it says of its views.
/// Deterministic. Throws Error where a panorama cannot be read. `capture` as of ArePanoramas.
Capture SplitPanoramas(const Capture& capture, const std::filesystem::path& folder,
                       Progress& progress);

}  // namespace dtr::capture
