// stereo/engine.h -- the one interface behind which all depth engines stand.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/types/camera.h"
#include "dtr/types/depth_image.h"
#include "dtr/types/grid.h"
#include "dtr/types/pose.h"
#include "stereo/depth_prior.h"
#include "stereo/plane_map.h"

namespace dtr::stereo {

struct TimeStepSource;  // stereo/time_step.h

/// A calibrated, undistorted photo. Borrowed: the pixels must outlive the call.
struct StereoView {
  PinholeCamera camera{1, 1, 1, 1, 0, 0};
  Pose cam_from_world;
  const ImageRgb8* image = nullptr;   ///< 8-bit sRGB, size of `camera`
  const Mask* mask = nullptr;         ///< null or empty: every pixel is usable
  const DepthPrior* prior = nullptr;  ///< null: nothing is known of its depth
  /// What other time steps say of it, for engines with passes; null: it is worked out alone.
  const TimeStepSource* time_step = nullptr;
};

/// Depths to search in the reference view, plane z in scene units, 0 < near_z < far_z.
struct DepthRange {
  double near_z = 0, far_z = 0;
};

/// Depth of one view. Rejected pixels are holes: an honest hole beats a wrong depth.
struct DepthEstimate {
  DepthImage depth;                 ///< plane z, size of the reference camera
  Grid<float> inverse_depth_sigma;  ///< standard deviation of 1/z; 0 where depth is a hole
};

/// How much work goes into a depth map. Every value may change the result.
struct QualitySettings {
  int neighbours = 5;       ///< views that the search compares with, at most
  int pass_neighbours = 8;  ///< views that the passes and the final filter ask, at most 8
  /// Visits per pixel on the levels between the coarsest (two more) and full size (two fewer, but
  /// one at least).
  int iterations = 3;
  int passes = 2;  ///< passes in which views take account of each other's planes
  bool operator==(const QualitySettings&) const = default;
};

struct EngineOptions {
  std::uint64_t seed = 0;  ///< for engines that draw random numbers
  bool look = false;       ///< the result is looked at and not kept: less work will do
  double memory_gb = 2.0;  ///< fewer threads run rather than use more; no effect on the result
};

/// None of a view's neighbours can be matched with it (no baseline, forward motion, no overlap).
class NoUsablePair : public Error {
 public:
  using Error::Error;
};

/// Computes the depth of one reference view from its neighbours; engines with passes also that of
/// a collection, each view held to what the others found (RunAllPasses).
/// Deterministic: same input, options and seed give the same bytes for any number of threads.
class Engine {
 public:
  virtual ~Engine() = default;
  virtual std::string name() const = 0;
  /// `views[reference]` is the reference; `neighbours` are indices into `views`, best first.
  /// Throws NoUsablePair when no neighbour can be matched, Error when the input cannot be used
  /// (empty range, image of another size than its camera).
  virtual DepthEstimate Estimate(std::span<const StereoView> views, int reference,
                                 std::span<const int> neighbours, const DepthRange& range,
                                 const EngineOptions& options) const = 0;

  /// Whether the range bounds what it finds.
  virtual bool Searches() const { return true; }
  /// How many neighbours of a view it makes use of.
  virtual int Neighbours() const { return 5; }

  /// Bytes that one call for this view takes at most, its result included and what it is given
  /// not, for any number of threads; 0 where the engine does not say.
  virtual std::uint64_t WorkBytes(std::span<const StereoView> /*views*/, int /*reference*/,
                                  std::span<const int> /*neighbours*/) const {
    return 0;
  }

  /// Passes in which views take account of each other's planes; 0: Estimate is all there is.
  virtual int Passes() const { return 0; }
  /// The planes behind Estimate, nothing rejected. Engines with passes only.
  virtual PlaneMap Match(std::span<const StereoView> views, int reference,
                         std::span<const int> neighbours, const DepthRange& range,
                         const EngineOptions& options) const;
  /// One pass: the planes of `reference` again, starting from `maps[reference]` and held to the
  /// planes of its neighbours. `maps` has one entry per view, null where there is none; `pass`
  /// counts from 1.
  virtual PlaneMap Refine(std::span<const StereoView> views, int reference,
                          std::span<const int> neighbours, const DepthRange& range,
                          std::span<const PlaneMap* const> maps, int pass,
                          const EngineOptions& options) const;
  /// Filters the planes after the last pass: depth and sigma.
  virtual DepthEstimate Filter(std::span<const StereoView> views, int reference,
                               std::span<const int> neighbours, const DepthRange& range,
                               std::span<const PlaneMap* const> maps,
                               const EngineOptions& options) const;
};

/// Engine by its name on the command line ("sgbm"), which makes use of `neighbours` alone.
/// Throws UsageError for unknown names and for settings out of range: 1 to 8 neighbours, 1 to 20
/// iterations, 0 to 8 passes.
std::unique_ptr<Engine> MakeEngine(const std::string& name, const QualitySettings& quality = {});

}  // namespace dtr::stereo
