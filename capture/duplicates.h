// capture/duplicates.h -- photos that are there twice.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "capture/photo.h"

namespace dtr::capture {

/// A photo that was taken out, and the one with the same image that stays.
struct LeftOut {
  std::string name, same_as;
};

/// Takes out photos that have the same pixels (upright) and mask as another one and lists them
/// under `skipped`. Of each such group those for which `preferred(name)` stay, else the first.
/// Needs the screening of IngestPhotos: what that does not call a duplicate is not looked at, what
/// it does is compared pixel by pixel, so that shots that merely resemble each other stay. Throws
/// Error when such a photo can no longer be read.
std::vector<LeftOut> DropSameImages(Capture& capture,
                                    const std::function<bool(const std::string&)>& preferred);

/// Takes out the photos that screening says show the same image as one of `held_out` (per photo)
/// and are not among these, and lists them under `skipped`: they would show what is held out.
/// `held_out` loses their entries. Needs the screening of IngestPhotos.
std::vector<LeftOut> DropCopiesOf(std::vector<bool>& held_out, Capture& capture);

}  // namespace dtr::capture
