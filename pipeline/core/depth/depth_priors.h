// pipeline/core/depth/depth_priors.h -- depth maps of photos, checked and made priors of stereo.
#pragma once
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/foreign_confidence.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"
#include "pipeline/core/depth_prior.h"
#include "stereo/depth_range.h"
#include "stereo/engine.h"

namespace dtr {
class TemporaryFolder;
}

namespace dtr::pipeline {

/// Cameras of the photos that views were undistorted from, by name of the photo: their pinhole
/// camera has the photo's size, and their depth file, where they name one, lies in the prior's
/// folder.
using PhotoCameras = std::map<std::string, io::NamedCamera>;

/// The priors of the source views of a set. Maps are read when they are needed.
class DepthPriors {
 public:
  /// `views`: the source views; `sources`, `scene`: the same for stereo. A view without an entry in
  /// `photos` is its own photo. Measures all maps against the scene's points, says in a few lines
  /// what came out, leaves out maps of single views that differ from the others, and corrects the
  /// scale where it is well determined. Throws Error for maps that show something else than the
  /// photos: shifted, too noisy, of another unit, or with an error that is no scale; UsageError for
  /// a folder without a map of any photo.
  DepthPriors(const DepthPriorChoice& choice, std::span<const View* const> views,
              std::span<const stereo::StereoView> sources, const SparseScene& scene,
              LengthUnit unit, const PhotoCameras& photos, Progress& progress);

  /// Gives the views their priors; this must outlive them.
  void Attach(std::span<stereo::StereoView> sources) const;

  /// Ranges that hold the priors' depths as well, but for the outermost per cent at either end.
  std::vector<stereo::DepthRange> Widened(std::vector<stereo::DepthRange> ranges) const;

  const DepthPriorReport& report() const { return report_; }

  DepthPriors(const DepthPriors&) = delete;
  DepthPriors& operator=(const DepthPriors&) = delete;

 private:
  DepthImage Load(size_t source) const;
  void Validate(LengthUnit unit, Progress& progress);
  void Say(const std::string& line, Progress& progress);
  void LeaveOutWhatDiffers(Progress& progress);
  void CorrectScale(LengthUnit unit, Progress& progress);
  void RequireOneScale() const;

  std::filesystem::path asked_;                      ///< the folder or recording, for messages
  DepthPriorChoice choice_;                          ///< its folder is that of the maps
  io::ConfidenceMaps confidence_;                    ///< of these
  std::shared_ptr<const TemporaryFolder> unpacked_;  ///< in which that is, where it was an archive
  std::vector<io::NamedCamera> cameras_;             ///< of the photos
  std::vector<PinholeCamera> grids_;                 ///< of the views
  std::vector<bool> has_map_;
  std::vector<stereo::DepthRange> ends_;  ///< of the maps as they are; 0: nothing measured
  std::vector<stereo::DepthPrior> priors_;
  DepthPriorReport report_;
};

/// An engine that takes the priors for the depth, as they are.
std::unique_ptr<stereo::Engine> MakePriorEngine();

}  // namespace dtr::pipeline
