// pipeline/core/metres.h -- what --gps and --distance say of cameras that are being refined.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "calib/bundle/metric_refine.h"
#include "dtr/io/image_io.h"
#include "pipeline/core/photo_positions.h"
#include "pipeline/core/scale_points.h"

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

/// Positions of photos as the refinement met them (calib::MetricReport has what each means).
struct PositionsReport {
  int photos = 0;                     ///< with a position
  std::vector<std::string> left_out;  ///< of these, those that do not agree with the others
  double given_rms_m = 0, rms_m = 0;
  /// Standard deviations that were found, per axis on the map and in height; 0: all were stated.
  double found_sigma_flat_m = 0, found_sigma_up_m = 0;
  bool determine_scale = true;
  double relative_sigma = 0;  ///< of the scale, as the positions alone give it
  int passes = 0;
  bool settled = true;
  double turn_sigma_deg = 0;
  io::GpsPosition origin;  ///< of the world, whose axes are east, north, up
};

/// A measured distance beside the same in the model as a whole and in the adjusted one.
struct DistanceReport {
  std::string text;  ///< as it was given
  double length_m = 0, given_m = 0, found_m = 0;
  double sigmas_off = 0;  ///< found_m from length_m, in standard deviations
};

/// How a model that was refined in metres got its size.
struct MetreReport {
  double metres_per_unit = 1;  ///< of the model that was given
  double relative_sigma = 0;
  std::optional<PositionsReport> positions;  ///< with --gps
  std::vector<DistanceReport> distances;
};

/// A model that was refined in metres.
struct RefinedInMetres {
  calib::Refined refined;
  calib::MetricStart start;        ///< with the priors that were held
  std::vector<std::string> lines;  ///< for people
  MetreReport report;
};

/// JSON object: that of calib::ToJson(refined), `unit`, and as `scale` the report by its field
/// names, as `dtr calibrate scale` keeps it in a set's provenance.
std::string ToJson(const RefinedInMetres& refined);

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

/// Refines `model` as StartInMetres and RefineInMetres do. `places` may be empty where
/// options.gps is not set. Throws Error as they do, and where a distance names a photo without a
/// camera.
RefinedInMetres RefineInMetres(const calib::SfmModel& model, const MetreOptions& options,
                               const PhotoPositions& places, const calib::RefineOptions& refine);

}  // namespace dtr::pipeline
