// pipeline/core/depth_prior.h -- depth of a depth camera or a phone as a prior of stereo.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dtr/types/camera.h"
#include "stereo/prior_agreement.h"

namespace dtr::pipeline {

/// A folder of depth maps, one per photo, of any grid that covers the photo's field of view.
struct DepthPriorChoice {
  std::filesystem::path folder;   ///< empty: there is no prior
  std::optional<double> unit;     ///< scene units per number; must be given for whole numbers
  std::optional<DepthKind> kind;  ///< empty: plane z
  bool given() const { return !folder.empty(); }
};

/// How the prior agreed with the photos, and what became of it.
struct DepthPriorReport {
  stereo::PriorAgreement agreement;
  std::vector<std::string> names;  ///< of agreement.views
  int photos = 0;                  ///< that could have a map
  double divided_by = 1;           ///< what all depths of the prior were divided by
  std::vector<std::string> lines;  ///< what was logged
};

/// JSON object: photos, maps, points, scale, scale_sigma, noise, outliers, divided_by,
/// by_distance[], views[].
std::string ToJson(const DepthPriorReport& report);

}  // namespace dtr::pipeline
