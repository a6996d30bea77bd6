// calib/sfm/run/held_out.h -- poses of photos that took no part in structure from motion.
#pragma once
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "calib/sfm/run/sfm.h"

namespace dtr::sfm {

/// Photos placed in a frozen model. The model itself is untouched: it is not part of the result.
struct HeldOutResult {
  /// Registered photos in order of names. `camera_id` is a key of `cameras`; features that were
  /// matched carry the frozen model's point ids, so that their reprojection can be evaluated.
  std::vector<calib::SfmImage> images;
  std::map<std::uint32_t, calib::LensCamera> cameras;
  std::vector<std::string> not_registered;
  SfmReport report;  ///< runs of all photos
};

/// Registers each photo of `held_out` in the frozen `source_model`, which RunSfm made of `sources`
/// in `source_workspace`. A photo whose camera group and size a registered source has takes that
/// source's frozen intrinsics, of a stabilised lens those that its photos have in common; another
/// gets its focal length estimated with its pose. Where the mapper needed other thresholds for
/// photos straight ahead of each other, registration has them, too.
///
/// Each photo is matched with source photos alone, in a database of its own, by programs of its
/// own: neither the model nor the pose of another held-out photo can depend on it. Poses are frozen
/// by checkpoints, not repeatable from scratch (see RunSfm). Up to kExhaustiveLimit sources
/// all are matched, beyond that the most resembling ones. Checkpoints and errors as in RunSfm; a
/// photo that COLMAP cannot place is no error but listed in not_registered.
HeldOutResult RegisterHeldOut(const std::filesystem::path& images_dir,
                              std::span<const SfmImageInput> held_out,
                              const calib::SfmModel& source_model,
                              std::span<const SfmImageInput> sources,
                              const std::filesystem::path& source_workspace,
                              const std::filesystem::path& workspace, const SfmOptions& options,
                              Progress& progress);

}  // namespace dtr::sfm
