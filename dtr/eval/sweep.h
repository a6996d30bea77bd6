// dtr/eval/sweep.h -- error against cost: which settings of a stage are worth what they take.
#pragma once
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dtr/base/progress.h"

namespace dtr::eval {

/// One choice of a stage and the values to try, as they are typed; the first is the default.
struct SweepAxis {
  std::string name;
  std::vector<std::string> values;
};

/// One value of every axis: indices into their values, so 0 throughout is the default.
using SweepSetting = std::vector<int>;

/// What a setting takes and what it is worth. Costs in the stage's unit.
struct SweepMeasurement {
  double cost = 0;                        ///< median of the repeats, > 0
  double cost_least = 0, cost_most = 0;   ///< of the repeats
  double error = 0;                       ///< > 0, smaller is better
  std::optional<double> psnr_db;          ///< where the error is one of images
  double machine_ms = 0;                  ///< what CalibrationLoop() took about then; 0: not timed
  std::map<std::string, double> figures;  ///< what else is known, by name
};

struct SweepPoint {
  SweepSetting setting;
  SweepMeasurement measured;
};

/// A stage that can be swept.
struct SweepStage {
  std::string name;          ///< "render"
  std::string cost_name;     ///< with its unit: "CPU ms a frame"
  std::string error_name;    ///< with its unit: "RMS error, 8-bit levels"
  bool cost_is_time = true;  ///< else it is the same on every machine, every time
  /// The first axis is what decides which others mean something: the method, the engine.
  std::vector<SweepAxis> axes;
  /// Whether another value of this axis could change anything under the setting, as the axes before
  /// it say.
  std::function<bool(const SweepSetting&, size_t axis)> applies;
  std::function<SweepMeasurement(const SweepSetting&)> measure;
};

/// Costs that another run of the setting may show: the range of the repeats, widened by as much as
/// the machine's speed moved during the whole sweep and by a tenth for what only another process
/// shows. Equal numbers where the cost is not a time.
struct CostRange {
  double least = 0, most = 0;
};
CostRange RangeOf(const SweepPoint& point, std::span<const SweepPoint> sweep);

/// Indices of the points that no other equals or beats in cost and error at once (Pareto front), by
/// rising cost. Of equal points the first stays.
std::vector<size_t> ParetoFront(std::span<const SweepPoint> points);

/// Position in `front` of the knee: with the logarithms of cost and error scaled to [0, 1] over the
/// front, the point farthest below the line between the front's ends (the "Kneedle" of Satopaa,
/// Albrecht, Irwin, Raghavan, ICDCS workshops 2011, without its smoothing). Empty where no point
/// lies below that line.
std::optional<size_t> KneeOf(std::span<const SweepPoint> points, std::span<const size_t> front);

/// Index of the cheapest point whose PSNR is at most `max_loss_db` below the best. Empty where no
/// point has a PSNR.
std::optional<size_t> CheapestWithin(std::span<const SweepPoint> points, double max_loss_db);
/// Index of the point of the least error that costs at most `budget`; of equal ones the cheapest.
std::optional<size_t> BestWithin(std::span<const SweepPoint> points, double budget);

/// What is to be said of the default among all points.
struct DefaultAssessment {
  size_t at = 0;  ///< index of the default
  bool on_front = false;
  /// The point that saves the most of its cost with no more error than the default; empty on the
  /// front.
  std::optional<size_t> beaten_by;
  /// Beaten, but the ranges of the two costs overlap: another run may say otherwise.
  bool within_spread = false;
};
/// Empty where the default was not measured.
std::optional<DefaultAssessment> AssessDefault(std::span<const SweepPoint> points,
                                               std::span<const size_t> front);

/// The default, every value of axis 0 alone, and every other value of every other axis, alone, on
/// the first value of axis 0 under which it means something; where there is none, on the first
/// value of another axis (the exponent on the weight that has one).
std::vector<SweepSetting> OneAtATime(const SweepStage& stage);

/// Up to `count` settings not measured yet that could move the front, the most promising first.
/// Predicted as if effects were independent: what a value did to the logarithms of cost and error
/// when it was alone is added up. Promise is the share of the front's extent by which the
/// prediction lies beyond it; settings that promise less than a hundredth are not offered.
std::vector<SweepSetting> Promising(const SweepStage& stage, std::span<const SweepPoint> points,
                                    int count);

/// Knows earlier results and keeps new ones, so that an interrupted sweep goes on.
class SweepStore {
 public:
  virtual ~SweepStore() = default;
  virtual std::optional<SweepMeasurement> Find(const SweepSetting& setting) const = 0;
  virtual void Keep(const SweepSetting& setting, const SweepMeasurement& measurement) = 0;
};

/// One measurement, with the machine's speed beside it where the cost is a time. Throws Error when
/// a cost or an error is not above 0.
SweepPoint MeasurePoint(const SweepStage& stage, const SweepSetting& setting);

/// Measures the settings one at a time around the default, then rounds of the promising
/// combinations, until `max_points` are measured or nothing promises more. In order of measuring.
/// Throws what the stage and the store throw, and Interrupted between points.
std::vector<SweepPoint> Sweep(const SweepStage& stage, int max_points, SweepStore& store,
                              Progress& progress);

/// Processor milliseconds, the median of three, of a fixed piece of work (arithmetic on numbers
/// from all over a buffer of 8 MiB, one thread): how fast core, caches and memory are just now.
double CalibrationLoop();

/// "--name" values of the setting that are not the default: "views=3 resolution=2"; "default".
std::string Describe(const SweepStage& stage, const SweepSetting& setting);

}  // namespace dtr::eval
