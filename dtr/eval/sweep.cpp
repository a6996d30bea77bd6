// Which settings to measure, and in which order.
#include "dtr/eval/sweep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <stdexcept>

#include "dtr/base/error.h"
#include "dtr/base/machine.h"

namespace dtr::eval {
namespace {

/// A place on the plane of logarithms.
struct LogPoint {
  double cost = 0, error = 0;
};

LogPoint LogOf(const SweepMeasurement& measured) {
  return {std::log(measured.cost), std::log(measured.error)};
}

SweepSetting With(SweepSetting setting, size_t axis, int value) {
  setting[axis] = value;
  return setting;
}

/// The setting on which an axis is tried alone: one value that is not the default, at most.
std::optional<SweepSetting> BaseOf(const SweepStage& stage, size_t axis) {
  const SweepSetting usual(stage.axes.size(), 0);
  for (size_t other = 0; other < axis; ++other) {
    for (int value = 0; value < static_cast<int>(stage.axes[other].values.size()); ++value) {
      const SweepSetting setting = With(usual, other, value);
      if ((other == 0 || stage.applies(usual, other)) && stage.applies(setting, axis)) {
        return setting;
      }
    }
  }
  return std::nullopt;
}

/// What each value did when it was alone.
class Effects {
 public:
  Effects(const SweepStage& stage, std::span<const SweepPoint> points) {
    for (const SweepPoint& point : points) measured_[point.setting] = LogOf(point.measured);
    for (size_t axis = 0; axis < stage.axes.size(); ++axis) bases_.push_back(BaseOf(stage, axis));
  }

  /// Empty where something it needs was not measured.
  std::optional<LogPoint> Predict(const SweepSetting& setting) const {
    SweepSetting base(setting.size(), 0);
    base[0] = setting[0];
    const auto start = measured_.find(base);
    if (start == measured_.end()) return std::nullopt;
    LogPoint sum = start->second;
    for (size_t axis = 1; axis < setting.size(); ++axis) {
      if (setting[axis] == 0) continue;
      const std::optional<LogPoint> effect = Alone(axis, setting[axis]);
      if (!effect) return std::nullopt;
      sum.cost += effect->cost;
      sum.error += effect->error;
    }
    return sum;
  }

  bool Measured(const SweepSetting& setting) const { return measured_.contains(setting); }

 private:
  std::optional<LogPoint> Alone(size_t axis, int value) const {
    const std::optional<SweepSetting>& base = bases_[axis];
    if (!base) return std::nullopt;
    const auto without = measured_.find(*base), with = measured_.find(With(*base, axis, value));
    if (without == measured_.end() || with == measured_.end()) return std::nullopt;
    return LogPoint{with->second.cost - without->second.cost,
                    with->second.error - without->second.error};
  }

  std::vector<std::optional<SweepSetting>> bases_;  ///< by axis
  std::map<SweepSetting, LogPoint> measured_;
};

/// Calls `visit` with every setting of the full product that means something throughout, `setting`
/// being fixed before `axis`: axes that mean nothing there are passed over, so that a choice with
/// many options of its own does not multiply the work for all others.
template <typename Visit>
void ForEachSetting(const SweepStage& stage, SweepSetting& setting, size_t axis,
                    const Visit& visit) {
  if (axis == setting.size()) return visit(setting);
  const bool means_something = axis == 0 || stage.applies(setting, axis);
  const int values = means_something ? static_cast<int>(stage.axes[axis].values.size()) : 1;
  for (int value = 0; value < values; ++value) {
    setting[axis] = value;
    ForEachSetting(stage, setting, axis + 1, visit);
  }
  setting[axis] = 0;
}

/// How far `point` lies beyond `front`: the share of the extents by which every point of the front
/// would have to move to equal it in both (additive epsilon indicator, Zitzler et al., IEEE TEC
/// 2003). Negative where a point of the front is better in both.
double GainOver(const std::vector<LogPoint>& front, const LogPoint& extent, const LogPoint& point) {
  double gain = HUGE_VAL;
  for (const LogPoint& other : front) {
    gain = std::min(gain, std::max((other.cost - point.cost) / extent.cost,
                                   (other.error - point.error) / extent.error));
  }
  return gain;
}

}  // namespace

std::vector<SweepSetting> OneAtATime(const SweepStage& stage) {
  if (stage.axes.empty()) throw std::invalid_argument("OneAtATime: a stage without choices");
  const SweepSetting usual(stage.axes.size(), 0);
  std::vector<SweepSetting> settings;
  for (size_t value = 0; value < stage.axes[0].values.size(); ++value) {
    settings.push_back(With(usual, 0, static_cast<int>(value)));
  }
  for (size_t axis = 1; axis < stage.axes.size(); ++axis) {
    const std::optional<SweepSetting> base = BaseOf(stage, axis);
    if (!base) continue;
    for (size_t value = 1; value < stage.axes[axis].values.size(); ++value) {
      settings.push_back(With(*base, axis, static_cast<int>(value)));
    }
  }
  return settings;
}

std::vector<SweepSetting> Promising(const SweepStage& stage, std::span<const SweepPoint> points,
                                    int count) {
  constexpr double kMinPromise = 0.01;  // of the front's extent: below what repeats tell apart
  const std::vector<size_t> indices = ParetoFront(points);
  if (indices.size() < 2) return {};
  std::vector<LogPoint> front;
  for (const size_t i : indices) front.push_back(LogOf(points[i].measured));
  const LogPoint extent{front.back().cost - front.front().cost,
                        front.front().error - front.back().error};
  const Effects effects(stage, points);
  struct Candidate {
    SweepSetting setting;
    LogPoint predicted;
  };
  std::vector<Candidate> candidates;
  SweepSetting start(stage.axes.size(), 0);
  ForEachSetting(stage, start, 0, [&](const SweepSetting& setting) {
    if (effects.Measured(setting)) return;
    const std::optional<LogPoint> predicted = effects.Predict(setting);
    if (predicted && GainOver(front, extent, *predicted) > kMinPromise) {
      candidates.push_back({setting, *predicted});
    }
  });
  std::vector<SweepSetting> chosen;
  while (static_cast<int>(chosen.size()) < count) {
    double most = kMinPromise;
    const Candidate* best = nullptr;
    for (const Candidate& candidate : candidates) {
      if (const double gain = GainOver(front, extent, candidate.predicted); gain > most) {
        most = gain;
        best = &candidate;
      }
    }
    if (best == nullptr) break;
    chosen.push_back(best->setting);
    front.push_back(best->predicted);  // so that the next one is elsewhere
  }
  return chosen;
}

SweepPoint MeasurePoint(const SweepStage& stage, const SweepSetting& setting) {
  const double before_ms = stage.cost_is_time ? CalibrationLoop() : 0;
  SweepMeasurement measured = stage.measure(setting);
  if (stage.cost_is_time) measured.machine_ms = (before_ms + CalibrationLoop()) / 2;
  if (!(measured.cost > 0) || !(measured.error > 0)) {
    throw Error("bench " + stage.name + ": " + Describe(stage, setting) +
                ": expected a cost and an error above 0, found none");
  }
  return {setting, std::move(measured)};
}

std::vector<SweepPoint> Sweep(const SweepStage& stage, int max_points, SweepStore& store,
                              Progress& progress) {
  constexpr int kPerRound = 4;
  std::vector<SweepPoint> points;
  progress.Stage("bench " + stage.name, max_points);
  const auto add = [&](const SweepSetting& setting) {
    if (static_cast<int>(points.size()) >= max_points) return;
    progress.ThrowIfInterrupted();
    if (std::optional<SweepMeasurement> known = store.Find(setting)) {
      points.push_back({setting, std::move(*known)});
    } else {
      points.push_back(MeasurePoint(stage, setting));
      store.Keep(setting, points.back().measured);
    }
    progress.Update(static_cast<int>(points.size()));
  };
  for (const SweepSetting& setting : OneAtATime(stage)) add(setting);
  while (static_cast<int>(points.size()) < max_points) {
    const std::vector<SweepSetting> round = Promising(stage, points, kPerRound);
    if (round.empty()) break;
    for (const SweepSetting& setting : round) add(setting);
  }
  return points;
}

double CalibrationLoop() {
  constexpr std::uint32_t kNumbers = (8u << 20) / sizeof(float);
  constexpr int kLaps = 300'000, kRuns = 3;
  constexpr size_t kStreams = 8;  // independent of each other: the core is kept busy
  const std::vector<float> buffer(kNumbers, 1.0f);
  std::vector<double> times_ms;
  for (int run = 0; run < kRuns; ++run) {
    std::array<float, kStreams> sums{};
    std::uint32_t place = 1;
    const double start_ms = ProcessCpuMilliseconds();
    for (int lap = 0; lap < kLaps; ++lap) {
      place = place * 1664525u + 1013904223u;  // Knuth, TAOCP 2, 3.3.4: anywhere in the buffer
      for (std::uint32_t k = 0; k < kStreams; ++k) {
        sums[k] = sums[k] * 0.75f + buffer[((place >> 8) + k * (kNumbers / kStreams)) % kNumbers];
      }
    }
    times_ms.push_back(ProcessCpuMilliseconds() - start_ms);
    // Looked at, so that it cannot be left out.
    for (const float sum : sums) {
      if (!(sum > 0)) throw std::logic_error("CalibrationLoop: numbers went astray");
    }
  }
  std::sort(times_ms.begin(), times_ms.end());
  return times_ms[kRuns / 2];
}

std::string Describe(const SweepStage& stage, const SweepSetting& setting) {
  std::string words;
  for (size_t axis = 0; axis < setting.size(); ++axis) {
    if (setting[axis] == 0) continue;
    words += (words.empty() ? "" : " ") + stage.axes[axis].name + "=" +
             stage.axes[axis].values[static_cast<size_t>(setting[axis])];
  }
  return words.empty() ? "default" : words;
}

}  // namespace dtr::eval
