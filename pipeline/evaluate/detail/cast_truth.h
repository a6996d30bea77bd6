// pipeline/evaluate/detail/cast_truth.h -- truth of scenes made by `dtr dataset`, on any grid.
#pragma once
#include <filesystem>
#include <optional>

#include "datasets/make.h"
#include "datasets/scene.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/types/depth_image.h"
#include "dtr/types/grid.h"
#include "dtr/types/view.h"

namespace dtr::pipeline {

/// Depth and what counts of it (255), on the grid of one view.
struct ViewTruth {
  DepthImage depth;  ///< plane z, lengths of the truth's world
  Mask scored;
};

/// A scene whose truth can be cast again: never resampled, so nothing is invented at silhouettes.
class CastTruth {
 public:
  /// Empty unless `folder` has a dataset.json. `list` is its cameras.json. Throws Error when it is
  /// broken.
  static std::optional<CastTruth> FromFolder(const std::filesystem::path& folder,
                                             const io::CameraList& list);

  /// Casts through the view's own camera from the true pose of list.cameras[index]. Scored is what
  /// two other true cameras see and what has texture, evaluated as `dtr dataset` does, on the
  /// view's grid.
  ViewTruth On(const View& view, size_t index) const;

 private:
  CastTruth(datasets::DatasetSpec spec, const io::CameraList& list);

  datasets::DatasetSpec spec_;
  datasets::Scene scene_;
  std::vector<Pose> cams_from_scene_;
};

}  // namespace dtr::pipeline
