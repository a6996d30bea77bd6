// pipeline/core/photo_positions.h -- where photos say that they were taken.
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "capture/photo.h"
#include "dtr/io/image_io.h"

namespace dtr::pipeline {

/// Photos with latitude, longitude and altitude in their EXIF.
struct PhotoPositions {
  std::vector<std::string> names;
  std::vector<io::GpsPosition> places;     ///< of these; each has an altitude
  std::vector<std::string> without_place;  ///< lines that name the others, with what is missing

  /// Index of the first place that lies where most do; there must be one.
  size_t Origin() const;
  /// Metres east, north and up of that place.
  std::vector<Eigen::Vector3d> EastNorthUp() const;
  /// What the axes are, for people.
  std::string AxesLine() const;
};

/// Of the files of these names below `folder`. Throws Error where one is there and no image.
PhotoPositions ReadPhotoPositions(const std::filesystem::path& folder,
                                  const std::vector<std::string>& names);

/// Of the photos of these names: what was read when they were taken in.
PhotoPositions PhotoPositionsOf(const capture::Capture& capture,
                                const std::vector<std::string>& names);

/// Throws Error with fewer places than a similarity can be told from (calib/scale.h). `where`: the
/// folder; `whose`: "the set", "the model".
void RequirePlaces(const PhotoPositions& places, const std::string& where,
                   const std::string& whose);

}  // namespace dtr::pipeline
