// pipeline/metres.h -- what --gps and --distance say of cameras that are being refined.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "calib/bundle/metric_refine.h"
#include "pipeline/detail/photos/photo_places.h"
#include "pipeline/scale_points.h"

namespace dtr::pipeline {

/// `--gps-sigma M[,V]`: standard deviations per axis, on the map and in height.
struct GpsSigma {
  double flat_m = 0, up_m = 0;
};

/// `--gps`, `--gps-sigma` and `--distance` beside a refinement.
struct MetreOptions {
  bool gps = false;
  std::optional<GpsSigma> gps_sigma;
  std::vector<ScaleDistance> distances;  ///< between cameras, called as their photos are
  int max_passes = calib::KnownMetres().max_passes;

  bool any() const { return gps || !distances.empty(); }
};

/// A model that was refined in metres.
struct RefinedInMetres {
  calib::Refined refined;
  calib::MetricStart start;        ///< with the priors that were held
  std::vector<std::string> lines;  ///< for people
  std::string json;                ///< of calib::ToJson(refined), and `scale` as below
  std::string scale_json;          ///< as `dtr calibrate scale` keeps it in a set's provenance
};

/// Throws UsageError where a distance is not between two of these photos, by names, or an extension
/// is needed to tell photos apart: pixels of images are for `dtr calibrate scale`, of a finished
/// set. `whose`: "the model".
void RequireCameras(const MetreOptions& options, const std::vector<std::string>& names,
                    const std::string& whose);

/// Rejects before any work what cannot be had of these photos: RequireCameras, a distance to a
/// photo with `held_back[i]` (empty: none), which will be no part of the model, and with --gps too
/// few of the others that say where they were taken. `where`: their folder.
void RequireMetres(const MetreOptions& options, const capture::Capture& photos,
                   const std::string& where, const std::vector<bool>& held_back = {});

/// JSON object: what can change a result.
std::string ToJson(const MetreOptions& options);

/// Refines `model` as StartInMetres and RefineInMetres do. `places` may be empty where
/// options.gps is not set. Throws Error as they do, and where a distance names a photo without a
/// camera.
RefinedInMetres RefineInMetres(const calib::SfmModel& model, const MetreOptions& options,
                               const PhotoPositions& places, const calib::RefineOptions& refine);

}  // namespace dtr::pipeline
